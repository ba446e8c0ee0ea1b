// A graph in memory that tests and benchmarks put together by hand.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "storage/testing/partial_graph.h"

namespace relmap::place {

// Cameras for its sessions: a pair of eyes, and the left one of them alone.
inline constexpr StereoCamera kStereoCamera{400, 256, 192, 0.12, 512, 384}, kMonoCamera{400, 256, 192, 0, 512, 384};

class HandMadeGraph final : public storage::PartialGraph {
 public:
  void add_session(SessionNumber number, const StereoCamera& camera) {
    storage::Session session;
    session.number = number;
    session.header.camera = camera;
    sessions_[number] = std::move(session);
  }
  void add_frame(FrameId id, storage::FrameHot hot = {}, storage::FrameWarm warm = {}, storage::FrameCold cold = {}) {
    hot.present = true;
    frames_[id] = {std::make_shared<storage::FrameHot>(std::move(hot)),
                   std::make_shared<storage::FrameWarm>(std::move(warm)),
                   std::make_shared<storage::FrameCold>(std::move(cold))};
    const auto found = sessions_.find(id.session);
    if (found == sessions_.end()) return;
    storage::Session& session = found->second;
    session.first = session.frames == 0 ? id.index : std::min(session.first, id.index);
    session.last = std::max(session.last, id.index);
    ++session.frames;
  }
  // Both frames must exist. The edge is stored with `b`, the newer one.
  void add_edge(FrameId a, FrameId b, std::uint32_t ordinal, const SE3& T_ab = {},
                const Matrix6& covariance = 1e-6 * Matrix6::Identity()) {
    storage::Edge edge;
    edge.id = {b, ordinal};
    edge.a = a;
    edge.b = b;
    edge.kind = ordinal == 0 ? storage::EdgeKind::kOdometry : storage::EdgeKind::kLoop;
    edge.T_ab = T_ab;
    edge.covariance = covariance;
    frames_.at(b).hot->edges.push_back(edge);
    frames_.at(a).hot->incoming.push_back(edge.id);
  }
  storage::Session& edit_session(SessionNumber number) { return sessions_.at(number); }
  storage::FrameHot& edit_hot(FrameId id) { return *frames_.at(id).hot; }
  storage::FrameWarm& edit_warm(FrameId id) { return *frames_.at(id).warm; }
  storage::FrameCold& edit_cold(FrameId id) { return *frames_.at(id).cold; }

  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override { return part(id, &Parts::hot); }
  std::shared_ptr<const storage::FrameWarm> warm(FrameId id) const override { return part(id, &Parts::warm); }
  std::shared_ptr<const storage::FrameCold> cold(FrameId id) const override { return part(id, &Parts::cold); }
  std::vector<storage::Session> all_sessions() const override {
    std::vector<storage::Session> all;
    for (const auto& [number, session] : sessions_) all.push_back(session);
    return all;
  }
  std::optional<storage::Session> session(SessionNumber number) const override {
    const auto found = sessions_.find(number);
    return found == sessions_.end() ? std::nullopt : std::optional(found->second);
  }

 private:
  struct Parts {
    std::shared_ptr<storage::FrameHot> hot;
    std::shared_ptr<storage::FrameWarm> warm;
    std::shared_ptr<storage::FrameCold> cold;
  };
  template <typename T>
  std::shared_ptr<const T> part(FrameId id, std::shared_ptr<T> Parts::*member) const {
    const auto found = frames_.find(id);
    return found == frames_.end() ? nullptr : found->second.*member;
  }

  std::map<SessionNumber, storage::Session> sessions_;
  std::map<FrameId, Parts> frames_;
};

}  // namespace relmap::place
