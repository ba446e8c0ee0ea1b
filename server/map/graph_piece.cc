#include "server/map/graph_piece.h"

#include <algorithm>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "proto/base/crc32c.h"

namespace relmap::map {

namespace {

constexpr double kMaxLoopLength = 1e7;             // metres
constexpr std::uint64_t kMaxIndices = 0xfffffffe;  // frames of a session

constexpr std::chrono::milliseconds kFullQueue{5};  // between attempts to queue a record
constexpr std::chrono::milliseconds kLookAround{50};

std::string frame_text(std::uint32_t index) { return "frame " + std::to_string(index); }

// Writes records to the journal, one after another.
class PieceWriter {
 public:
  PieceWriter(Mapper& mapper, const std::function<Status()>& proceed) : mapper_(mapper), proceed_(proceed) {}

  Status write(const storage::JournalRecord& record) {
    for (;;) {
      auto promise = std::make_shared<std::promise<Result<std::uint64_t>>>();
      outcomes_.push_back(promise->get_future());
      const Status queued =
          mapper_.submit(record, [promise](const Result<std::uint64_t>& sequence) { promise->set_value(sequence); });
      if (queued.ok()) return {};
      outcomes_.pop_back();
      if (queued.reason() != Reason::BUDGET_EXCEEDED) return queued;
      if (Status going = proceed_(); !going.ok()) return going;
      std::this_thread::sleep_for(kFullQueue);
    }
  }
  // Waits until all records are durable and applied. Returns the sequence of the last one; 0 if there were none.
  Result<std::uint64_t> finish(std::chrono::steady_clock::time_point deadline) {
    std::uint64_t last = 0;
    for (auto& outcome : outcomes_) {
      while (outcome.wait_for(kLookAround) != std::future_status::ready)
        if (Status going = proceed_(); !going.ok()) return going;
      const auto sequence = outcome.get();
      if (!sequence.ok()) return sequence.status();
      last = *sequence;
    }
    if (last > 0)
      if (Status applied = mapper_.wait_applied(last, deadline); !applied.ok()) return applied;
    return last;
  }

 private:
  Mapper& mapper_;
  const std::function<Status()>& proceed_;
  std::vector<std::future<Result<std::uint64_t>>> outcomes_;
};

}  // namespace

Result<GraphPiece> GraphPiece::make(SessionHeader header, std::uint32_t first, std::uint32_t frames) {
  if (std::uint64_t{first} + frames > kMaxIndices)
    return {Reason::INVALID_ARGUMENT, "frames beyond index " + std::to_string(kMaxIndices - 1)};
  return GraphPiece(std::move(header), first);
}

Status GraphPiece::add_frame(Keyframe keyframe) {
  keyframe.session = header_;
  keyframe.sequence = next_index();
  if (Status good = check_keyframe(keyframe); !good.ok())
    return {good.reason(), frame_text(keyframe.sequence) + ": " + good.message()};
  if (!frames_.empty() && keyframe.time_us <= frames_.back().time_us)
    return {Reason::BAD_DURATION, frame_text(keyframe.sequence) + " is no later than the one before"};
  frames_.push_back(std::move(keyframe));
  return {};
}

Status GraphPiece::fit(const storage::Graph& map) {
  const auto sessions = map.sessions();
  const auto known = std::find_if(sessions.begin(), sessions.end(),
                                  [&](const storage::Session& session) { return session.header.uuid == header_.uuid; });
  const std::uint64_t next = known == sessions.end() ? 0 : known->next_sequence;
  if (first_ > next) return {Reason::NO_SUCH_FRAME, "frames from " + std::to_string(next) + " on are missing"};
  for (const storage::ClosureProposalRecord& loop : loops_)
    if (loop.query.index >= std::max<std::uint64_t>(next, std::uint64_t{first_} + frames_.size()))
      return {Reason::NO_SUCH_FRAME, "a loop from " + frame_text(loop.query.index) + ", which does not exist"};
  std::erase_if(frames_, [&](const Keyframe& keyframe) { return keyframe.sequence < next; });
  if (known != sessions.end() && known->frames > 0 && !frames_.empty() &&
      frames_.front().time_us <= known->last_time_us)
    return {Reason::TIME_BACKWARDS, frame_text(frames_.front().sequence) + " is no later than the last one of the map"};
  return {};
}

Result<SessionNumber> GraphPiece::begin(Mapper& mapper) {
  const auto number = mapper.begin_session(header_);
  if (!number.ok()) return number.status();
  session_ = *number;
  for (storage::ClosureProposalRecord& loop : loops_) loop.query.session = loop.match.session = *number;
  return *number;
}

Result<std::uint64_t> GraphPiece::write(Mapper& mapper, std::chrono::steady_clock::time_point deadline,
                                        const std::function<Status()>& proceed) const {
  PieceWriter writer(mapper, proceed);
  for (const Keyframe& keyframe : frames_) {
    Bytes payload = encode_keyframe(keyframe);
    const std::uint32_t crc = crc32c(payload);
    if (Status taken = writer.write(storage::KeyframeRecord{session_, crc, std::move(payload)}); !taken.ok())
      return taken;
  }
  for (const storage::ClosureProposalRecord& loop : loops_)
    if (Status taken = writer.write(loop); !taken.ok()) return taken;
  return writer.finish(deadline);
}

Status check_loop_ends(std::uint32_t query, std::uint32_t match) {
  if (query > match) return {};
  return {Reason::INVALID_ARGUMENT,
          query == match ? "it leads from a frame to itself" : "query must be the later frame"};
}

Status check_loop_motion(const SE3& T_match_query) {
  if (T_match_query.t.norm() <= kMaxLoopLength) return {};
  return {Reason::BAD_MOTION, "its ends are more than 10,000 km apart"};
}

}  // namespace relmap::map
