// Converts the messages of Ingest.Stream (proto/relmap/v1/ingest.proto) to and from plain values.
#pragma once

#include <string>

#include "proto/keyframe/ingest_messages.h"

namespace relmap::v1 {
class Acknowledgement;
class IngestReply;
class IngestRequest;
class Welcome;
}  // namespace relmap::v1

namespace relmap::publishing {

v1::IngestRequest hello_request(const std::string& robot);
v1::IngestRequest keyframe_request(const KeyframePart& whole);  // the only part of its keyframe
v1::IngestRequest gap_request(const Gap& gap);
v1::IngestRequest end_request(const SessionEnd& end);

// UNKNOWN_PROTOCOL_VERSION, CORRUPT.
Result<DaemonIdentity> read_welcome(const v1::Welcome& welcome);
// CORRUPT if sizes or orders are such as no daemon sends; INVALID_ARGUMENT if the session's uuid is malformed.
Result<Acknowledgement> read_acknowledgement(const v1::Acknowledgement& message);
// Reads a localisation, a pace or the end of a session; `boot` is the daemon's. CORRUPT if it is none of these or its
// numbers are impossible; also the reasons of frames, transforms and covariances.
Result<PoseNews> read_news(const v1::IngestReply& reply, const BootId& boot);

}  // namespace relmap::publishing
