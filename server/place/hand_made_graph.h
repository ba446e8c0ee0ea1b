// A graph put together by hand, all in memory: for tests and measurements.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "storage/graph.h"

namespace relmap {

class HandMadeGraph final : public Graph {
 public:
  void add_session(SessionNumber number, const StereoCamera& camera) {
    Session session;
    session.number = number;
    session.header.camera = camera;
    sessions_[number] = std::move(session);
  }
  void add_frame(FrameId id, FrameHot hot = {}, FrameWarm warm = {}, FrameCold cold = {}) {
    hot.present = true;
    frames_[id] = {std::make_shared<FrameHot>(std::move(hot)), std::make_shared<FrameWarm>(std::move(warm)),
                   std::make_shared<FrameCold>(std::move(cold))};
    const auto found = sessions_.find(id.session);
    if (found == sessions_.end()) return;
    Session& session = found->second;
    session.first = session.frames == 0 ? id.index : std::min(session.first, id.index);
    session.last = std::max(session.last, id.index);
    ++session.frames;
  }
  // Stored with `b`, the newer; both frames exist.
  void add_edge(FrameId a, FrameId b, std::uint32_t ordinal, const SE3& T_ab = {},
                const Matrix6& covariance = 1e-6 * Matrix6::Identity()) {
    Edge edge;
    edge.id = {b, ordinal};
    edge.a = a;
    edge.b = b;
    edge.kind = ordinal == 0 ? EdgeKind::kOdometry : EdgeKind::kLoop;
    edge.T_ab = T_ab;
    edge.covariance = covariance;
    frames_.at(b).hot->edges.push_back(edge);
    frames_.at(a).hot->incoming.push_back(edge.id);
  }
  Session& edit_session(SessionNumber number) { return sessions_.at(number); }
  FrameHot& edit_hot(FrameId id) { return *frames_.at(id).hot; }
  FrameWarm& edit_warm(FrameId id) { return *frames_.at(id).warm; }
  FrameCold& edit_cold(FrameId id) { return *frames_.at(id).cold; }

  std::shared_ptr<const FrameHot> hot(FrameId id) const override { return part(id, &Parts::hot); }
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override { return part(id, &Parts::warm); }
  std::shared_ptr<const FrameCold> cold(FrameId id) const override { return part(id, &Parts::cold); }
  std::vector<Session> sessions() const override {
    std::vector<Session> all;
    for (const auto& [number, session] : sessions_) all.push_back(session);
    return all;
  }
  std::optional<Session> session(SessionNumber number) const override {
    const auto found = sessions_.find(number);
    return found == sessions_.end() ? std::nullopt : std::optional(found->second);
  }
  void visit_settled(SessionNumber, std::uint32_t, const SettledVisit&) const override {}
  std::vector<FrameId> labelled(const std::string&) const override { return {}; }
  std::vector<std::string> labels(const std::string&) const override { return {}; }

 private:
  struct Parts {
    std::shared_ptr<FrameHot> hot;
    std::shared_ptr<FrameWarm> warm;
    std::shared_ptr<FrameCold> cold;
  };
  template <typename T>
  std::shared_ptr<const T> part(FrameId id, std::shared_ptr<T> Parts::*member) const {
    const auto found = frames_.find(id);
    return found == frames_.end() ? nullptr : found->second.*member;
  }

  std::map<SessionNumber, Session> sessions_;
  std::map<FrameId, Parts> frames_;
};

}  // namespace relmap
