// Plants wrong loop closures in a map: with the figures of true ones, but between other frames, and put into force as
// an operator would put them. Look-alike places make such closures, and nothing of their own tells them from true ones.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"
#include "tools/sim/random.h"

namespace relmap::bench {

// The map in which they are planted, and the truth of its frames.
struct PlantingGround {
  std::function<void(const storage::JournalRecord&)> apply;      // returns once the map shows it
  std::function<std::shared_ptr<const storage::Graph>()> graph;  // as it is now
  std::function<std::optional<Vector3>(FrameId)> where;          // the true position; nullopt: not known
};

class Planter {
 public:
  // The ends of a planted closure are more than `apart` metres from each other in truth.
  Planter(PlantingGround ground, double apart, std::uint64_t seed)
      : ground_(std::move(ground)), apart_(apart), random_(seed, 77, 0) {}

  // Plants one closure that stands by itself, within a session or between two, or up to `length` that agree with each
  // other, as along two stretches that look alike. Copies the figures of a true closure in force; plants nothing if
  // there is none, or no place for it.
  void plant(std::uint32_t length);

  const std::vector<EdgeId>& planted() const { return planted_; }

 private:
  struct Site {
    FrameId a, b;
  };
  std::vector<storage::Edge> donors(const storage::Graph& graph) const;
  FrameId some_frame(const storage::Graph& graph, std::uint32_t before_end);
  std::optional<Site> site(const storage::Graph& graph, std::uint32_t length);
  bool plant(const Site& site, const storage::Edge& donor, const SE3& T_ab);

  const PlantingGround ground_;
  const double apart_;
  sim::Stream random_;
  std::vector<EdgeId> planted_;
};

}  // namespace relmap::bench
