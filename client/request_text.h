// The texts of a request, before it is sent. Internal to client/.
#pragma once

#include "proto/base/status.h"

namespace google::protobuf {
class Message;
}

namespace relmap::client {

// INVALID_ARGUMENT: one of its texts is not UTF-8, and which. A daemon cannot read such a request, nor say which it is.
Status check_texts(const google::protobuf::Message& request);

}  // namespace relmap::client
