#include <algorithm>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include "proto/base/crc32c.h"
#include "proto/base/names.h"
#include "proto/geometry/camera.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "server/rpc/handlers.h"

namespace relmap::rpc {

namespace {

constexpr int kMaxPerMessage = 1000;
constexpr std::chrono::milliseconds kPause{5};
constexpr std::chrono::milliseconds kPatience{50};
constexpr double kMaxMetres = 1e7;  // metres

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

Result<Keyframe> keyframe_of(const v1::ImportedFrame& frame, const SessionHeader& header, std::uint32_t index) {
  Keyframe keyframe;
  keyframe.session = header;
  keyframe.sequence = index;
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
  if (Status good = check_keyframe(keyframe); !good.ok()) return good;
  return keyframe;
}

Result<storage::ClosureProposalRecord> proposal_of(const v1::ImportedLoop& loop, SessionNumber session) {
  if (loop.query() <= loop.match())
    return {Reason::INVALID_ARGUMENT,
            loop.query() == loop.match() ? "it leads from a frame to itself" : "query must be the later frame"};
  storage::ClosureProposalRecord proposal;
  proposal.query = {session, loop.query()};
  proposal.match = {session, loop.match()};
  proposal.verification = storage::Verification::kImported;
  const auto T = from_wire(loop.match_from_query());
  if (!T.ok()) return T.status();
  if (!(T->t.norm() <= kMaxMetres)) return {Reason::BAD_MOTION, "its ends are more than 10,000 km apart"};
  proposal.T_match_query = *T;
  const auto covariance = from_wire(loop.covariance());
  if (!covariance.ok()) return covariance.status();
  proposal.covariance = *covariance;
  return proposal;
}

// The part of a message that is to be written, after its session has begun.
struct Piece {
  SessionNumber session = 0;
  std::vector<Keyframe> frames;  // those that the map does not hold yet
  std::vector<storage::ClosureProposalRecord> loops;
};

Result<Piece> check_piece(map::Mapper& mapper, const v1::ImportGraphRequest& request) {
  if (request.frames_size() > kMaxPerMessage || request.loops_size() > kMaxPerMessage)
    return {Reason::INVALID_ARGUMENT, "more than " + std::to_string(kMaxPerMessage) + " frames or loops in a piece"};
  const auto header = header_of(request);
  if (!header.ok()) return header.status();
  if (std::uint64_t{request.first()} + static_cast<std::uint64_t>(request.frames_size()) > 0xfffffffeu)
    return {Reason::INVALID_ARGUMENT, "frames beyond index 4294967293"};

  std::vector<Keyframe> frames;
  for (int i = 0; i < request.frames_size(); ++i) {
    const std::uint32_t index = request.first() + static_cast<std::uint32_t>(i);
    auto keyframe = keyframe_of(request.frames(i), *header, index);
    if (!keyframe.ok()) return named("frame " + std::to_string(index), keyframe.status());
    if (!frames.empty() && keyframe->time_us <= frames.back().time_us)
      return {Reason::BAD_DURATION, "frame " + std::to_string(index) + " is no later than the one before"};
    frames.push_back(std::move(keyframe).value());
  }
  Piece piece;
  for (const v1::ImportedLoop& loop : request.loops()) {
    auto proposal = proposal_of(loop, 0);
    if (!proposal.ok())
      return named("the loop " + std::to_string(loop.query()) + " - " + std::to_string(loop.match()),
                   proposal.status());
    piece.loops.push_back(std::move(proposal).value());
  }

  const auto sessions = mapper.view()->sessions();
  const auto known = std::find_if(sessions.begin(), sessions.end(),
                                  [&](const storage::Session& session) { return session.header.uuid == header->uuid; });
  const std::uint64_t next = known == sessions.end() ? 0 : known->next_sequence;
  if (request.first() > next) return {Reason::NO_SUCH_FRAME, "frames from " + std::to_string(next) + " on are missing"};
  for (const storage::ClosureProposalRecord& loop : piece.loops)
    if (loop.query.index >= std::max<std::uint64_t>(next, request.first() + frames.size()))
      return {Reason::NO_SUCH_FRAME,
              "a loop from frame " + std::to_string(loop.query.index) + ", which does not exist"};
  for (Keyframe& keyframe : frames)
    if (keyframe.sequence >= next) piece.frames.push_back(std::move(keyframe));
  if (known != sessions.end() && known->frames > 0 && !piece.frames.empty() &&
      piece.frames.front().time_us <= known->last_time_us)
    return {Reason::TIME_BACKWARDS,
            "frame " + std::to_string(piece.frames.front().sequence) + " is no later than the last one of the map"};

  const auto number = mapper.begin_session(*header);
  if (!number.ok()) return number.status();
  piece.session = *number;
  for (storage::ClosureProposalRecord& loop : piece.loops) loop.query.session = loop.match.session = *number;
  return piece;
}

// Writes records to the journal, one after another.
class Writer {
 public:
  Writer(map::Mapper& mapper, const Deadline& deadline) : mapper_(mapper), deadline_(deadline) {}

  Status write(const storage::JournalRecord& record) {
    for (;;) {
      auto promise = std::make_shared<std::promise<Result<std::uint64_t>>>();
      outcomes_.push_back(promise->get_future());
      const Status queued =
          mapper_.submit(record, [promise](const Result<std::uint64_t>& sequence) { promise->set_value(sequence); });
      if (queued.ok()) return {};
      outcomes_.pop_back();
      if (queued.reason() != Reason::BUDGET_EXCEEDED) return queued;
      if (Status in_time = deadline_.check(); !in_time.ok()) return in_time;
      std::this_thread::sleep_for(kPause);
    }
  }
  // Waits until all records are durable and applied. Returns the sequence of the last one; 0 if there were none.
  Result<std::uint64_t> finish() {
    std::uint64_t last = 0;
    for (auto& outcome : outcomes_) {
      while (outcome.wait_for(kPatience) != std::future_status::ready)
        if (Status in_time = deadline_.check(); !in_time.ok()) return in_time;
      const auto sequence = outcome.get();
      if (!sequence.ok()) return sequence.status();
      last = *sequence;
    }
    if (last > 0)
      if (Status applied = mapper_.wait_applied(last, deadline_.at); !applied.ok()) return applied;
    return last;
  }

 private:
  map::Mapper& mapper_;
  const Deadline& deadline_;
  std::vector<std::future<Result<std::uint64_t>>> outcomes_;
};

}  // namespace

Result<v1::ImportGraphReply> import_graph(const v1::ImportGraphRequest& request, const Deadline& deadline,
                                          map::Mapper& mapper, ImportTurn& turn) {
  // One at a time, since a piece is checked against the map, and pieces must not occupy the threads of all other calls.
  const std::unique_lock held(turn.mutex, std::try_to_lock);
  if (!held.owns_lock()) return {Reason::BUDGET_EXCEEDED, "another piece of a graph is being taken in; try again"};
  const auto piece = check_piece(mapper, request);
  if (!piece.ok()) return piece.status();
  v1::ImportGraphReply reply;
  reply.set_session(piece->session);
  reply.set_frames_known(static_cast<std::uint32_t>(request.frames_size()) -
                         static_cast<std::uint32_t>(piece->frames.size()));
  Writer writer(mapper, deadline);
  for (const Keyframe& keyframe : piece->frames) {
    Bytes payload = encode_keyframe(keyframe);
    const std::uint32_t crc = crc32c(payload);
    if (Status taken = writer.write(storage::KeyframeRecord{piece->session, crc, std::move(payload)}); !taken.ok())
      return taken;
  }
  for (const storage::ClosureProposalRecord& loop : piece->loops)
    if (Status taken = writer.write(loop); !taken.ok()) return taken;
  // The next piece is checked against the frames of this one, so they must be in the map first.
  const auto written = writer.finish();
  if (!written.ok()) return written.status();
  reply.set_journal_sequence(*written);
  reply.set_map_version(mapper.view()->version());
  return reply;
}

}  // namespace relmap::rpc
