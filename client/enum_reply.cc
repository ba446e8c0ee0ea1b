#include "client/enum_reply.h"

#include <string>

#include "relmap/v1/common.pb.h"
#include "relmap/v1/graph.pb.h"

namespace relmap::client {

namespace {

// The numbers of an enum of map_types.h are those of the protocol, from `first` to `last` without a gap.
template <typename Enum>
Status read_between(Enum first, Enum last, int wire, const char* what, Enum& value) {
  if (wire < static_cast<int>(first) || wire > static_cast<int>(last))
    return {Reason::CORRUPT, std::string("the daemon's ") + what + " is not known here: " + std::to_string(wire) +
                                 "; the daemon may be newer than this client"};
  value = static_cast<Enum>(wire);
  return {};
}

}  // namespace

Status read_enum(v1::EdgeKind wire, EdgeKind& value) {
  return read_between(EdgeKind::kOdometry, EdgeKind::kPrior, wire, "kind of an edge", value);
}
Status read_enum(v1::EdgeState wire, EdgeState& value) {
  return read_between(EdgeState::kCandidate, EdgeState::kRemoved, wire, "state of an edge", value);
}
Status read_enum(v1::Verification wire, Verification& value) {
  return read_between(Verification::kNone, Verification::kCompounded, wire, "kind of verification", value);
}
Status read_enum(v1::MotionSource wire, MotionSource& value) {
  return read_between(MotionSource::kStart, MotionSource::kUnsensed, wire, "source of motion", value);
}
Status read_enum(v1::SessionState wire, SessionState& value) {
  return read_between(SessionState::kOpen, SessionState::kDeleting, wire, "state of a session", value);
}
Status read_enum(v1::DoubtKind wire, DoubtKind& value) {
  return read_between(DoubtKind::kFewInliers, DoubtKind::kUnseen, wire, "kind of doubt", value);
}

}  // namespace relmap::client
