// Forwards every call to another graph: the base of graphs that stand in front of another one and answer some calls
// themselves.
#pragma once

#include "storage/graph/graph.h"

namespace relmap::storage {

// `Interface` is Graph, or EditableGraph, whose edits the derived class implements.
template <typename Interface>
class ForwardingGraph : public Interface {
 public:
  std::shared_ptr<const FrameHot> hot(FrameId id) const override { return to_.hot(id); }
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override { return to_.warm(id); }
  std::shared_ptr<const FrameCold> cold(FrameId id) const override { return to_.cold(id); }
  void visit_sessions(SessionNumber from, const Graph::SessionVisit& visit) const override {
    to_.visit_sessions(from, visit);
  }
  SessionCounts session_counts() const override { return to_.session_counts(); }
  std::optional<Session> session(SessionNumber number) const override { return to_.session(number); }
  void visit_skipped(SessionNumber session, std::uint32_t sequence, const Graph::SkippedVisit& visit) const override {
    to_.visit_skipped(session, sequence, visit);
  }
  std::vector<FrameId> labelled(const std::string& label) const override { return to_.labelled(label); }
  std::vector<std::string> labels(const std::string& prefix) const override { return to_.labels(prefix); }

 protected:
  explicit ForwardingGraph(const Graph& to) : to_(to) {}  // which must outlive it

 private:
  const Graph& to_;
};

}  // namespace relmap::storage
