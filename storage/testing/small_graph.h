// A small graph in memory that is built edge by edge.
#pragma once

#include <algorithm>
#include <map>

#include "storage/testing/partial_graph.h"

namespace relmap::storage {

class SmallGraph final : public PartialGraph {
 public:
  FrameHot& frame(FrameId id) {
    auto& frame = frames_[id];
    if (!frame) frame = std::make_shared<FrameHot>(), frame->present = true;
    return *frame;
  }
  // Adds an edge from the older frame a to the newer frame b, with which it is stored.
  Edge& join(FrameId a, FrameId b, std::uint32_t ordinal = 0, const SE3& T_ab = {}) {
    auto& incoming = frame(a).incoming;
    incoming.insert(std::upper_bound(incoming.begin(), incoming.end(), EdgeId{b, ordinal}), {b, ordinal});
    Edge edge;
    edge.id = {b, ordinal};
    edge.a = a;
    edge.b = b;
    edge.T_ab = T_ab;
    frame(b).edges.push_back(edge);
    return frame(b).edges.back();
  }

  FrameWarm& warm_frame(FrameId id) {
    auto& frame = warm_[id];
    if (!frame) frame = std::make_shared<FrameWarm>();
    return *frame;
  }

  std::shared_ptr<const FrameHot> hot(FrameId id) const override {
    const auto found = frames_.find(id);
    return found == frames_.end() ? nullptr : found->second;
  }
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override {
    const auto found = warm_.find(id);
    return found == warm_.end() ? nullptr : found->second;
  }

 private:
  std::map<FrameId, std::shared_ptr<FrameHot>> frames_;
  std::map<FrameId, std::shared_ptr<FrameWarm>> warm_;
};

// A session of so many frames, each joined to the one before.
inline SmallGraph chain_of(std::uint32_t frames) {
  SmallGraph graph;
  graph.frame({1, 0});
  for (std::uint32_t i = 1; i < frames; ++i) graph.join({1, i - 1}, {1, i});
  return graph;
}

}  // namespace relmap::storage
