// Collects libdc1394's log of an error, since its error codes say little.
#pragma once

#include <string>

#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// Must be called before all other functions of libdc1394.
void keep_library_log();
// The messages of this thread since the last call.
std::string library_words();

// A status with the message `what`, followed by the library's messages.
Status library_error(Reason reason, const std::string& what);

}  // namespace relmap::iidc::dc1394
