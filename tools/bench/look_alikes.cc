#include "tools/bench/look_alikes.h"

#include <algorithm>
#include <vector>

#include "tools/sim/random.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kMinFrames = 40;  // between the ends of a loop
constexpr double kMinMetres = 10;         // that a look-alike lies from the true place
constexpr double kMaxBeside = 3;          // metres between where two views of what is taken for one place stand
constexpr double kMaxBetween = 3;         // frames from one recognised place to the next
constexpr double kSigmaMetres = 0.2, kSigmaRadians = 0.02;

}  // namespace

std::vector<g2o::PoseGraph::Edge> look_alikes(const g2o::PoseGraph& graph, std::uint32_t stretches,
                                              std::uint64_t seed) {
  std::vector<g2o::PoseGraph::Edge> loops;
  const auto frames = static_cast<std::uint32_t>(graph.ids.size());
  std::vector<SE3> T_odom_frame(1);
  for (const g2o::PoseGraph::Edge& step : graph.odometry)
    T_odom_frame.push_back((T_odom_frame.back() * step.T_ab).normalized());
  if (frames < 4 * kMinFrames || T_odom_frame.size() != frames) return loops;

  sim::Stream random(seed, 1, 0);
  for (std::uint32_t made = 0; made < stretches;) {
    const auto length = static_cast<std::uint32_t>(random.uniform(2, 13));
    const auto query = static_cast<std::uint32_t>(random.uniform(2 * kMinFrames, frames - 4 * length));
    const auto match = static_cast<std::uint32_t>(random.uniform(0, query - kMinFrames));
    if ((T_odom_frame[query].t - T_odom_frame[match].t).norm() < kMinMetres) continue;
    ++made;
    // Where a robot stands in a place that it takes for another is where it would stand there.
    const SE3 beside = SE3::exp(
        (Vector6() << random.normal() * 0.5, 0, random.normal() * 0.5, 0, random.normal() * 0.05, 0).finished());
    std::uint32_t along = 0;
    for (std::uint32_t k = 0; k < length;
         ++k, along += static_cast<std::uint32_t>(random.uniform(1, kMaxBetween + 1))) {
      if (match + along + kMinFrames >= query + along || query + along >= frames) break;
      // The stretches are alike: what the odometry says along the one it would say along the other.
      const SE3 way = T_odom_frame[match].inverse() * T_odom_frame[match + along];
      const SE3 own = T_odom_frame[query].inverse() * T_odom_frame[query + along];
      Vector6 noise;
      for (int i = 0; i < 6; ++i) noise[i] = random.normal() * (i < 3 ? kSigmaMetres : kSigmaRadians);
      const SE3 T_match_query = way.inverse() * beside * own;
      if (T_match_query.t.norm() > kMaxBeside) break;  // the ways part
      g2o::PoseGraph::Edge loop;
      loop.a = query + along;
      loop.b = match + along;
      loop.T_ab = (T_match_query * SE3::exp(noise)).inverse();
      loop.covariance = (Vector6() << Vector3::Constant(kSigmaMetres * kSigmaMetres),
                         Vector3::Constant(kSigmaRadians * kSigmaRadians))
                            .finished()
                            .asDiagonal();
      loops.push_back(loop);
    }
  }
  return loops;
}

}  // namespace relmap::bench
