// A graph for tests and benchmarks, which override only what they ask for. Everything else is empty.
#pragma once

#include "storage/graph/graph.h"

namespace relmap::storage {

class PartialGraph : public Graph {
 public:
  std::shared_ptr<const FrameWarm> warm(FrameId) const override { return nullptr; }
  std::shared_ptr<const FrameCold> cold(FrameId) const override { return nullptr; }
  virtual std::vector<Session> all_sessions() const { return {}; }  // ascending by number
  void visit_sessions(SessionNumber from, const SessionVisit& visit) const override {
    for (const Session& session : all_sessions())
      if (session.number >= from && !visit(session)) return;
  }
  std::optional<Session> session(SessionNumber) const override { return std::nullopt; }
  void visit_skipped(SessionNumber, std::uint32_t, const SkippedVisit&) const override {}
  std::vector<FrameId> labelled(const std::string&) const override { return {}; }
  std::vector<std::string> labels(const std::string&) const override { return {}; }
};

}  // namespace relmap::storage
