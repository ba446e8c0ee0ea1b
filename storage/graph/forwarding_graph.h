// Passes every question on to another graph: the base of those that stand before one and answer a part themselves.
#pragma once

#include "storage/graph/graph.h"

namespace relmap::storage {

// `Interface`: Graph, or EditableGraph, whose edits are for the derived class to answer.
template <typename Interface>
class ForwardingGraph : public Interface {
 public:
  std::shared_ptr<const FrameHot> hot(FrameId id) const override { return to_.hot(id); }
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override { return to_.warm(id); }
  std::shared_ptr<const FrameCold> cold(FrameId id) const override { return to_.cold(id); }
  std::vector<Session> sessions() const override { return to_.sessions(); }
  std::optional<Session> session(SessionNumber number) const override { return to_.session(number); }
  void visit_settled(SessionNumber session, std::uint32_t sequence, const Graph::SettledVisit& visit) const override {
    to_.visit_settled(session, sequence, visit);
  }
  std::vector<FrameId> labelled(const std::string& label) const override { return to_.labelled(label); }
  std::vector<std::string> labels(const std::string& prefix) const override { return to_.labels(prefix); }

 protected:
  explicit ForwardingGraph(const Graph& to) : to_(to) {}  // which must outlive it

 private:
  const Graph& to_;
};

}  // namespace relmap::storage
