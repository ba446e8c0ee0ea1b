// All that changes the map is a journal record; applying one is a pure function of the map and the record
// (server/map/map_builder.h). The bytes are documented in docs/storage-format.md; each record carries the highest
// journal sequence that was acknowledged when it was written.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/keyframe/keyframe.h"
#include "storage/graph/frame.h"

namespace relmap::storage {

// The session `header.uuid` has number `number` from here on.
struct SessionRecord {
  SessionNumber number = 0;
  std::string display_name;
  SessionHeader header;
};

struct KeyframeRecord {
  SessionNumber session = 0;
  std::uint32_t crc = 0;  // of payload
  Bytes payload;          // decode_keyframe()
};

// from..to are settled without keyframes: given up by the robot, or refused.
struct GapRecord {
  SessionNumber session = 0;
  std::uint32_t from = 0, to = 0;
  Reason reason = Reason::DROPPED_BY_ROBOT;
};
struct RefusalRecord {
  SessionNumber session = 0;
  std::uint32_t sequence = 0;
  std::uint32_t crc = 0;
  Reason reason = Reason::INTERNAL;
};

// A re-observation found beside the worker: frame `frame` sees `landmark`, by its own tracked landmark (`track` >= 0,
// index into Keyframe::tracks), by an appearance feature with this measurement, or aligned in its picture. An invalid
// landmark: the track's own is not needed (AliasClaim).
struct ProposedBinding {
  LandmarkId landmark;
  std::int32_t track = -1;
  float u_left = 0, v = 0, u_right = 0;
  std::uint8_t level = 0;
  bool aligned = false;
};

// A place that was recognised and verified: a closure, to be accepted or kept as a candidate.
struct ClosureProposalRecord {
  FrameId query, match;  // query is the newer: the closure will be stored there
  SE3 T_match_query;
  Matrix6 covariance = Matrix6::Identity();
  Verification verification = Verification::kStereo;
  std::uint16_t inliers = 0;
  float probability = 0;
  float spread = 0;
  std::vector<ProposedBinding> bindings;
  Uniqueness uniqueness;
  Extensions unknown = {};  // of a later version: kept as they came
};

// Landmarks seen again by projection along an accepted closure, no new place needed (docs/method.md, 2).
struct BindingRecord {
  FrameId frame;
  ClosureId closure;
  std::vector<ProposedBinding> bindings;
};

// An operator's edits.
struct SetEdgeStateRecord {
  EdgeId edge;
  EdgeState state = EdgeState::kRemoved;
  std::string note;
  // With kAccepted: it comes into force by the operator's word, whatever it is now, and is never outvoted. Else what
  // was removed becomes what it was before.
  bool decided = false;
  // With kRemoved: it goes alone. Those that agree with it stay in force, and later ones are judged as if it had never
  // been proposed; else they go with it.
  bool alone = false;
  // With kRemoved: what would go when the operator looked (removal_mark(), server/map/edge_edit.h); where it is
  // something else by now nothing goes. 0: whatever there is.
  std::uint64_t shown = 0;
  Extensions unknown = {};  // of a later version: kept as they came
};
struct SetLabelRecord {
  FrameId frame;
  std::string label;
  bool present = true;      // false: taken off
  Extensions unknown = {};  // of a later version: kept as they came
};

// A robot ended its session, or an operator's edit.
struct SetSessionStateRecord {
  SessionNumber session = 0;
  SessionState state = SessionState::kOpen;  // open: a frozen one is thawed, and what it was before (before_frozen)
  Extensions unknown = {};                   // of a later version: kept as they came
};

// The last `chunk` of a session that is being deleted leaves the map (server/map/deletion.h).
struct RemoveChunkRecord {
  SessionNumber session = 0;
  std::uint32_t chunk = 0;
};

// Relaxation done in idle time: this many units of counted work (linearised observations).
struct IdleWorkRecord {
  std::uint64_t budget = 0;
};

using JournalRecord =
    std::variant<SessionRecord, KeyframeRecord, GapRecord, RefusalRecord, ClosureProposalRecord, BindingRecord,
                 SetEdgeStateRecord, SetLabelRecord, IdleWorkRecord, SetSessionStateRecord, RemoveChunkRecord>;

Bytes encode_record(const JournalRecord& record, std::uint64_t acknowledged_through);

struct DecodedRecord {
  JournalRecord record;
  std::uint64_t acknowledged_through = 0;
};
// CORRUPT, TRUNCATED or UNKNOWN_FORMAT_VERSION.
Result<DecodedRecord> decode_record(ByteSpan bytes);

}  // namespace relmap::storage
