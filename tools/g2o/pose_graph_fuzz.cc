// Parses any text as a pose graph, and checks that an accepted graph is consistent.
#include "proto/geometry/covariance.h"
#include "tools/g2o/pose_graph.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto graph =
      relmap::g2o::parse_pose_graph({reinterpret_cast<const char*>(data), size}, "fuzz", relmap::g2o::PoseAxes::kRobot);
  if (!graph.ok()) return 0;
  if (graph->ids.size() != graph->poses.size()) __builtin_trap();
  for (const auto* edges : {&graph->odometry, &graph->loops})
    for (const auto& edge : *edges)
      if (edge.a == edge.b || edge.a >= graph->ids.size() || edge.b >= graph->ids.size()) __builtin_trap();
  for (const auto& step : graph->odometry)
    if (step.b != step.a + 1 || graph->step_to(step.b) != &step) __builtin_trap();
  return 0;
}
