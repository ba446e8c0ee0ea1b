// Converts what ingest tells a robot to messages of the Ingest service, and a robot's messages to plain values.
#pragma once

#include "proto/keyframe/ingest_messages.h"
#include "relmap/v1/ingest.pb.h"

namespace relmap::rpc {

v1::Welcome welcome_message(const DaemonIdentity& daemon);
v1::Acknowledgement acknowledgement_message(const Acknowledgement& ack);
v1::IngestReply news_message(const PoseNews& news);

// INVALID_ARGUMENT (invalid uuid), CORRUPT (unknown reason).
Result<Gap> read_gap(const v1::Gap& message);
Result<SessionEnd> read_end(const v1::SessionEnd& message);

}  // namespace relmap::rpc
