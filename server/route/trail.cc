#include "server/route/trail.h"

#include <algorithm>

namespace relmap::route {

namespace {

std::uint16_t place_of(EdgeId edge, FrameId frame, const std::vector<storage::Neighbour>& steps) {
  const auto at = std::find_if(steps.begin(), steps.end(), [&](const storage::Neighbour& n) { return n.edge == edge; });
  const auto place = static_cast<std::size_t>(at - steps.begin());
  if (at == steps.end() || place > 0xfff0)
    throw StatusError(Status(Reason::DATA_LOSS, "edge " + edge.to_string() + " is missing from frame " +
                                                    frame.to_string() + ", where it ends"));
  return static_cast<std::uint16_t>(place);
}

std::shared_ptr<const storage::FrameHot> existing(const storage::Graph& graph, FrameId frame) {
  auto hot = graph.hot(frame);
  if (!hot)
    throw StatusError(Status(Reason::DATA_LOSS, "frame " + frame.to_string() + " is missing, to which an edge leads"));
  return hot;
}

}  // namespace

std::uint16_t Trail::arrival(FrameId frame) const {
  const auto found = chunks_.find(storage::chunk_id(frame));
  return found == chunks_.end() ? kNever : found->second[storage::slot_of(frame)];
}

void Trail::settle(FrameId frame, const std::vector<storage::Neighbour>& steps, EdgeId edge) {
  const std::uint16_t code = edge.valid() ? static_cast<std::uint16_t>(kFirst + place_of(edge, frame, steps)) : kStart;
  std::uint16_t& arrival = chunks_[storage::chunk_id(frame)][storage::slot_of(frame)];
  frames_ += arrival == kNever;
  arrival = code;
}

std::set<SessionNumber> Trail::sessions() const {
  std::set<SessionNumber> numbers;
  for (const auto& [chunk, codes] : chunks_) numbers.insert(chunk.session);
  return numbers;
}

std::size_t Trail::memory_bytes() const {
  const std::size_t node = sizeof(*chunks_.begin()) + 2 * sizeof(void*);
  return chunks_.size() * node + chunks_.bucket_count() * sizeof(void*);
}

Result<Path> Trail::trace(const storage::Graph& graph, FrameId goal, const WorkLimit& work,
                          const Visitor& visit) const {
  Path path{goal, goal, {}, supposed_};
  auto hot = existing(graph, goal);
  std::vector<storage::Neighbour> steps = storage::neighbours(graph, goal, *hot, supposed_);
  for (std::uint16_t code = arrival(goal); code != kStart; code = arrival(path.from)) {
    if (path.turns.size() % kWorkStride == 0 && work.proceed)
      if (Status status = work.proceed(memory_bytes() + path.memory_bytes()); !status.ok()) return status;
    const storage::Neighbour back = steps.at(code - kFirst);
    visit(*EdgeRef(graph, path.from, hot, back));
    path.from = back.frame;
    hot = existing(graph, path.from);
    steps = storage::neighbours(graph, path.from, *hot, supposed_);
    path.turns.push_back(place_of(back.edge, path.from, steps));
  }
  return path;
}

std::optional<PathWalk::Step> PathWalk::next() {
  if (taken_ > path_.turns.size()) return std::nullopt;
  Step step{frame_, existing(graph_, frame_), std::nullopt, false};
  if (taken_ < path_.turns.size()) {
    const std::uint16_t turn = path_.turns[path_.turns.size() - 1 - taken_];
    const auto steps = storage::neighbours(graph_, frame_, *step.hot, path_.supposed);
    if (turn >= steps.size())
      throw StatusError(Status(Reason::DATA_LOSS, "an edge of frame " + frame_.to_string() + " is missing"));
    step.edge.emplace(graph_, frame_, step.hot, steps[turn]);
    step.forward = steps[turn].forward;
    frame_ = steps[turn].frame;
  }
  ++taken_;
  return step;
}

}  // namespace relmap::route
