// Checks the texts of a request before it is sent. Internal to client/.
#pragma once

#include "proto/base/status.h"

namespace google::protobuf {
class Message;
}

namespace relmap::client {

// INVALID_ARGUMENT, with the name of the field, if a text is not UTF-8. A daemon cannot parse such a request, and so
// could not say which text it is.
Status check_texts(const google::protobuf::Message& request);

}  // namespace relmap::client
