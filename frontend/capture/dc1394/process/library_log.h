// What libdc1394 says of an error: its codes tell little, and its log goes nowhere else.
#pragma once

#include <string>

#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// Before all else.
void keep_library_log();
// Of this thread, since it was called last.
std::string library_words();

// `what` went wrong, with the library's words behind it.
Status library_error(Reason reason, const std::string& what);

}  // namespace relmap::iidc::dc1394
