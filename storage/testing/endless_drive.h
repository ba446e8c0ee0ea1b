// A drive straight ahead of any length, one metre per frame, that takes no memory: each frame is made when it is asked
// for. For searches over large maps.
#pragma once

#include "storage/testing/partial_graph.h"

namespace relmap::storage {

class EndlessDrive final : public PartialGraph {
 public:
  explicit EndlessDrive(std::uint32_t frames) : frames_(frames) {}
  std::shared_ptr<const FrameHot> hot(FrameId id) const override {
    if (id.session != 1 || id.index >= frames_) return nullptr;
    auto hot = std::make_shared<FrameHot>();
    hot->present = true;
    if (id.index > 0) {
      Edge edge;
      edge.id = {id, 0};
      edge.a = {1, id.index - 1};
      edge.b = id;
      edge.T_ab.t = {0, 0, 1};
      hot->edges.push_back(edge);
    }
    if (id.index + 1 < frames_) hot->incoming.push_back({{1, id.index + 1}, 0});
    return hot;
  }
  std::vector<Session> all_sessions() const override { return {*session(1)}; }
  std::optional<Session> session(SessionNumber) const override {
    Session session;
    session.number = 1;
    session.header.camera = {400, 256, 192, 0.12, 512, 384};
    session.frames = frames_;
    session.last = frames_ - 1;
    return session;
  }

 private:
  const std::uint32_t frames_;
};

}  // namespace relmap::storage
