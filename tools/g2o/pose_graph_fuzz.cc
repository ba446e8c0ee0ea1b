// Parses any text as a pose graph, with both kinds of axes and from a file, and checks that an accepted graph is
// consistent.
#include <array>
#include <string>

#include "proto/base/testing/fuzzing.h"
#include "storage/testing/temporary_folder.h"
#include "tools/g2o/pose_graph.h"

namespace {

using namespace relmap;
using fuzzing::must;

void check(const g2o::PoseGraph& graph) {
  must(graph.ids.size() == graph.poses.size());
  for (const auto* edges : {&graph.odometry, &graph.loops})
    for (const auto& edge : *edges) must(edge.a != edge.b && edge.a < graph.ids.size() && edge.b < graph.ids.size());
  for (const auto& step : graph.odometry) must(step.b == step.a + 1 && graph.step_to(step.b) == &step);
  for (const auto& loop : graph.loops) must(loop.a > loop.b);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const storage::TemporaryFolder kFolder;
  const std::string path = kFolder / "graph.g2o";
  fuzzing::write_file(path, {data, size});
  for (const auto axes : {g2o::PoseAxes::kRobot, g2o::PoseAxes::kCamera}) {
    const auto graph = g2o::parse_pose_graph(fuzzing::text_of({data, size}), "fuzz", axes);
    must(g2o::read_pose_graph(path, axes).reason() == graph.reason());
    if (graph.ok()) check(*graph);
  }
  return 0;
}
