#include "proto/base/mutex.h"
#include "proto/base/names.h"
#include "proto/geometry/camera.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "server/map/graph_piece.h"
#include "server/rpc/handlers.h"
#include "server/rpc/request_context.h"

namespace relmap::rpc {

namespace {

constexpr int kMaxPerMessage = 1000;

Result<SessionHeader> header_of(const v1::ImportGraphRequest& request) {
  const auto uuid = uuid_from_wire(request.session_uuid());
  if (!uuid.ok()) return uuid.status();
  if (Status named = check_name("robot name", request.robot()); !named.ok()) return named;
  if (Status named = check_name("session name", request.name()); !named.ok()) return named;
  SessionHeader header;
  header.uuid = *uuid;
  header.robot = request.robot();
  header.name = request.name();
  header.camera = kNoCamera;
  return header;
}

Status named(const std::string& what, const Status& status) {
  return {status.reason(), what + ": " + status.message()};
}

// The session and sequence are left to the piece.
Result<Keyframe> keyframe_of(const v1::ImportedFrame& frame) {
  Keyframe keyframe;
  keyframe.time_us = static_cast<std::int64_t>(frame.time_us());
  keyframe.driven_us = static_cast<std::int64_t>(frame.driven_us());
  const auto pose = from_wire(frame.odom_from_frame());
  if (!pose.ok()) return pose.status();
  keyframe.T_odom_frame = *pose;
  if (frame.has_step()) {
    const auto covariance = from_wire(frame.step());
    if (!covariance.ok()) return covariance.status();
    keyframe.source = MotionSource::kVision;
    keyframe.step_covariance = *covariance;
  }
  return keyframe;
}

Result<storage::ClosureProposalRecord> proposal_of(const v1::ImportedLoop& loop) {
  if (Status ends = map::check_loop_ends(loop.query(), loop.match()); !ends.ok()) return ends;
  storage::ClosureProposalRecord proposal;
  proposal.query.index = loop.query();
  proposal.match.index = loop.match();
  proposal.verification = storage::Verification::kImported;
  const auto T = from_wire(loop.match_from_query());
  if (!T.ok()) return T.status();
  if (Status motion = map::check_loop_motion(*T); !motion.ok()) return motion;
  proposal.T_match_query = *T;
  const auto covariance = from_wire(loop.covariance());
  if (!covariance.ok()) return covariance.status();
  proposal.covariance = *covariance;
  proposal.submitted.author = current_author();
  return proposal;
}

Result<map::GraphPiece> piece_of(const v1::ImportGraphRequest& request) {
  if (request.frames_size() > kMaxPerMessage || request.loops_size() > kMaxPerMessage)
    return {Reason::INVALID_ARGUMENT, "more than " + std::to_string(kMaxPerMessage) + " frames or loops in a piece"};
  auto header = header_of(request);
  if (!header.ok()) return header.status();
  auto piece = map::GraphPiece::make(std::move(header).value(), request.first(),
                                     static_cast<std::uint32_t>(request.frames_size()));
  if (!piece.ok()) return piece.status();
  for (const v1::ImportedFrame& frame : request.frames()) {
    auto keyframe = keyframe_of(frame);
    if (!keyframe.ok()) return named("frame " + std::to_string(piece->next_index()), keyframe.status());
    if (Status added = piece->add_frame(std::move(keyframe).value()); !added.ok()) return added;
  }
  for (const v1::ImportedLoop& loop : request.loops()) {
    auto proposal = proposal_of(loop);
    if (!proposal.ok())
      return named("the loop " + std::to_string(loop.query()) + " - " + std::to_string(loop.match()),
                   proposal.status());
    piece->add_loop(std::move(proposal).value());
  }
  return piece;
}

}  // namespace

Result<v1::ImportGraphReply> import_graph(const v1::ImportGraphRequest& request, const Deadline& deadline,
                                          map::Mapper& mapper, ImportTurn& turn) {
  // One at a time, since a piece is checked against the map, and pieces must not occupy the threads of all other calls.
  if (!turn.mutex.try_lock()) return {Reason::BUDGET_EXCEEDED, "another piece of a graph is being taken in; try again"};
  const MutexLock held(turn.mutex, std::adopt_lock);
  auto piece = piece_of(request);
  if (!piece.ok()) return piece.status();
  if (Status fits = piece->fit(*mapper.view()); !fits.ok()) return fits;
  const auto session = piece->begin(mapper);
  if (!session.ok()) return session.status();
  v1::ImportGraphReply reply;
  reply.set_session(*session);
  reply.set_frames_known(static_cast<std::uint32_t>(request.frames_size()) -
                         static_cast<std::uint32_t>(piece->frames().size()));
  const auto written = piece->write(mapper, deadline.at, [&] { return deadline.check(); });
  if (!written.ok()) return written.status();
  reply.set_journal_sequence(*written);
  reply.set_map_version(mapper.view()->version());
  return reply;
}

}  // namespace relmap::rpc
