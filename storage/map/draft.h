// An editable graph on top of one that stays as it is, to find out what an edit would do. It is thrown away afterwards.
#pragma once

#include <cstddef>
#include <functional>
#include <unordered_map>

#include "storage/graph/forwarding_graph.h"
#include "storage/map/map.h"

namespace relmap::storage {

// Not thread-safe.
class Draft final : public ForwardingGraph<EditableGraph> {
 public:
  // Called for each frame that is copied, with the bytes of all copies so far. A status other than OK is thrown
  // (StatusError).
  using Proceed = std::function<Status(std::size_t bytes)>;

  // `base` must outlive the draft. state() begins with `facts`, the counts of the base.
  explicit Draft(const Graph& base, const MapFacts& facts = {}, Proceed proceed = {});

  std::shared_ptr<const FrameHot> hot(FrameId id) const override;
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override;

  FrameHot& edit_hot(FrameId id) override;
  FrameWarm& edit_warm(FrameId id) override;
  MapState& state() override { return state_; }

 private:
  template <typename Frame>
  using Copies = std::unordered_map<FrameId, std::shared_ptr<Frame>>;

  template <typename Frame>
  Frame& edit(Copies<Frame>& copies, FrameId id, const std::shared_ptr<const Frame>& now);

  const Proceed proceed_;
  Copies<FrameHot> hot_;
  Copies<FrameWarm> warm_;
  MapState state_;
  std::size_t bytes_ = 0;
};

}  // namespace relmap::storage
