#include "storage/map/draft.h"

namespace relmap::storage {

Draft::Draft(const Graph& base, const MapFacts& facts, Proceed proceed)
    : ForwardingGraph(base), proceed_(std::move(proceed)) {
  static_cast<MapFacts&>(state_) = facts;
}

std::shared_ptr<const FrameHot> Draft::hot(FrameId id) const {
  const auto copy = hot_.find(id);
  return copy != hot_.end() ? copy->second : ForwardingGraph::hot(id);
}

std::shared_ptr<const FrameWarm> Draft::warm(FrameId id) const {
  const auto copy = warm_.find(id);
  return copy != warm_.end() ? copy->second : ForwardingGraph::warm(id);
}

template <typename Frame>
Frame& Draft::edit(Copies<Frame>& copies, FrameId id, const std::shared_ptr<const Frame>& now) {
  if (!now) throw StatusError(Status(Reason::NO_SUCH_FRAME, "no frame " + id.to_string()));
  bytes_ += memory_bytes(*now);
  if (proceed_)
    if (Status status = proceed_(bytes_); !status.ok()) throw StatusError(status);
  return *copies.emplace(id, std::make_shared<Frame>(*now)).first->second;
}

FrameHot& Draft::edit_hot(FrameId id) {
  const auto copy = hot_.find(id);
  return copy != hot_.end() ? *copy->second : edit(hot_, id, ForwardingGraph::hot(id));
}

FrameWarm& Draft::edit_warm(FrameId id) {
  const auto copy = warm_.find(id);
  return copy != warm_.end() ? *copy->second : edit(warm_, id, ForwardingGraph::warm(id));
}

}  // namespace relmap::storage
