// A graph for tests and benchmarks that has only what they ask it for: what is not overridden is not there.
#pragma once

#include "storage/graph/graph.h"

namespace relmap::storage {

class PartialGraph : public Graph {
 public:
  std::shared_ptr<const FrameWarm> warm(FrameId) const override { return nullptr; }
  std::shared_ptr<const FrameCold> cold(FrameId) const override { return nullptr; }
  std::vector<Session> sessions() const override { return {}; }
  std::optional<Session> session(SessionNumber) const override { return std::nullopt; }
  void visit_settled(SessionNumber, std::uint32_t, const SettledVisit&) const override {}
  std::vector<FrameId> labelled(const std::string&) const override { return {}; }
  std::vector<std::string> labels(const std::string&) const override { return {}; }
};

}  // namespace relmap::storage
