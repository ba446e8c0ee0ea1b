// What ingest says to a robot, as messages of the Ingest service, and what it hears, as plain values.
#pragma once

#include "proto/keyframe/ingest_messages.h"
#include "relmap/v1/ingest.pb.h"

namespace relmap::rpc {

v1::Welcome welcome_message(const DaemonIdentity& daemon);
v1::Acknowledgement acknowledgement_message(const Acknowledgement& ack);
v1::IngestReply news_message(const PoseNews& news);

// INVALID_ARGUMENT (uuid), CORRUPT (a reason that is none of ours).
Result<Gap> read_gap(const v1::Gap& message);
Result<SessionEnd> read_end(const v1::SessionEnd& message);

}  // namespace relmap::rpc
