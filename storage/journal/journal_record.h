// Journal records. Every change of the map is a record, and applying a record is a pure function of the map and the
// record (server/map/map_builder.h). docs/storage-format.md describes the bytes. Each record carries the highest
// journal sequence that was acknowledged when it was written.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/keyframe/keyframe.h"
#include "storage/graph/frame.h"
#include "storage/graph/map_state.h"

namespace relmap::storage {

// When a record was submitted, and by whom. It says how the map came about and not what it is: no hash and no
// comparison of maps depends on it.
struct Submission {
  std::int64_t time_us = 0;  // UTC; 0: not known
  std::string author;        // the name in the caller's credentials; empty: a robot's own stream, or the daemon itself.
                             // The RPCs call that "relmapd"

  bool operator==(const Submission&) const = default;
};

// From here on the session `header.uuid` has the number `number`.
struct SessionRecord {
  SessionNumber number = 0;
  std::string display_name;
  SessionHeader header;
  Submission submitted = {};
};

struct KeyframeRecord {
  SessionNumber session = 0;
  std::uint32_t crc = 0;  // CRC32C of payload
  Bytes payload;          // an encoded keyframe: decode_keyframe()
};

// The sequences from..to are skipped: the robot gave them up, or they were refused.
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

// A re-observation that was found beside the worker: the frame of the record sees `landmark`. It was found by the
// frame's own tracked landmark (`track` >= 0, an index into Keyframe::tracks), by an appearance feature with this
// measurement, or by alignment in the frame's picture (`aligned`). An invalid landmark says that the track's own
// landmark is not needed (AliasClaim).
struct ProposedBinding {
  LandmarkId landmark;
  std::int32_t track = -1;
  float u_left = 0, v = 0, u_right = 0;  // pixels
  std::uint8_t level = 0;
  bool aligned = false;
};

// A place that was recognised and verified: a closure, to be accepted or kept as a candidate.
struct ClosureProposalRecord {
  FrameId query, match;  // query is the newer frame: the closure is stored with it
  SE3 T_match_query;
  Matrix6 covariance = Matrix6::Identity();
  Verification verification = Verification::kStereo;
  std::uint16_t inliers = 0;
  float probability = 0;
  float spread = 0;
  std::vector<ProposedBinding> bindings;
  Uniqueness uniqueness;
  std::shared_ptr<const WayAround> around;  // null: see Edge::around
  ClosureId unseen = {};                    // valid: the query has seen nothing of this one's place, as in UnseenRecord
  Extensions unknown = {};                  // from a later version, kept unchanged
  EditKey edit = {};                        // of an operator's proposal
  Submission submitted = {};
};

// Landmarks that were seen again by projection along an accepted closure, without a new place (docs/method.md, 2).
struct BindingRecord {
  FrameId frame;
  ClosureId closure;
  std::vector<ProposedBinding> bindings;
};

// The robot went on from where it made `closure`. By that closure, `frame` should have seen landmarks of the map, and
// it saw none of them.
struct UnseenRecord {
  FrameId frame;  // of the session of the closure's newer end, after it
  ClosureId closure;
  Extensions unknown = {};  // from a later version
  Submission submitted = {};
};

// An operator's edits.
struct SetEdgeStateRecord {
  EdgeId edge;
  EdgeState state = EdgeState::kRemoved;
  std::string note;
  // With kAccepted: true puts the edge into force by the operator's decision, whatever its state is now, and it is
  // never outvoted. False returns a removed edge to the state that it had before.
  bool decided = false;
  // With kRemoved: true removes this edge only. Those that agree with it stay in force, and later ones are judged as if
  // it had never been proposed. False removes those that agree with it too.
  bool alone = false;
  // With kRemoved: a mark of what would have been removed when the operator looked (removal_mark(),
  // server/map/edge_edit.h). If the present mark differs, the edit removes nothing. 0: the mark is not checked.
  std::uint64_t shown = 0;
  Extensions unknown = {};  // from a later version, kept unchanged
  EditKey edit = {};
  Submission submitted = {};
};
struct SetLabelRecord {
  FrameId frame;
  std::string label;
  bool present = true;      // false: the label is removed
  Extensions unknown = {};  // from a later version, kept unchanged
  EditKey edit = {};
  Submission submitted = {};
};

// The robot ended its session, or an operator changed its state.
struct SetSessionStateRecord {
  SessionNumber session = 0;
  SessionState state = SessionState::kOpen;  // kOpen thaws a frozen session to what it was before (before_frozen)
  Extensions unknown = {};                   // from a later version, kept unchanged
  EditKey edit = {};                         // of an operator's change
  Submission submitted = {};
};

// Removes `chunk`, the last one of a session that is being deleted, from the map (server/map/deletion.h).
struct RemoveChunkRecord {
  SessionNumber session = 0;
  std::uint32_t chunk = 0;
  Extensions unknown = {};    // from a later version
  Submission submitted = {};  // the author is who wanted the session deleted
};

// Relaxation that was done in idle time. `budget` is the work, counted in linearised observations.
struct IdleWorkRecord {
  std::uint64_t budget = 0;
};

using JournalRecord = std::variant<SessionRecord, KeyframeRecord, GapRecord, RefusalRecord, ClosureProposalRecord,
                                   BindingRecord, SetEdgeStateRecord, SetLabelRecord, IdleWorkRecord,
                                   SetSessionStateRecord, RemoveChunkRecord, UnseenRecord>;

// The name of the edit that the record is, or null if it is none that a caller can name.
template <typename Record>
auto edit_key(Record& record) {
  using Key = std::conditional_t<std::is_const_v<Record>, const EditKey, EditKey>;
  return std::visit(
      [](auto& r) -> Key* {
        if constexpr (requires { r.edit; })
          return &r.edit;
        else
          return nullptr;
      },
      record);
}

// When the record was submitted and by whom, or null if the record does not say so.
template <typename Record>
auto submission(Record& record) {
  using Submitted = std::conditional_t<std::is_const_v<Record>, const Submission, Submission>;
  return std::visit(
      [](auto& r) -> Submitted* {
        if constexpr (requires { r.submitted; })
          return &r.submitted;
        else
          return nullptr;
      },
      record);
}

Bytes encode_record(const JournalRecord& record, std::uint64_t acknowledged_through);

struct DecodedRecord {
  JournalRecord record;
  std::uint64_t acknowledged_through = 0;
};
// CORRUPT, TRUNCATED or UNKNOWN_FORMAT_VERSION.
Result<DecodedRecord> decode_record(ByteSpan bytes);

}  // namespace relmap::storage
