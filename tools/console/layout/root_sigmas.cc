#include "tools/console/layout/root_sigmas.h"

#include <limits>

#include "client/path_uncertainty.h"
#include "client/springs.h"

namespace relmap::console {
namespace {

client::RelaxationEdge edge_between(const MapLayout& layout, FrameId a, std::uint32_t at_a, FrameId b,
                                    std::uint32_t at_b, Matrix6 covariance) {
  client::RelaxationEdge edge;
  edge.a = a;
  edge.b = b;
  edge.T_ab = SE3{layout.rotation_of(at_a), layout.points[at_a].position}.inverse() *
              SE3{layout.rotation_of(at_b), layout.points[at_b].position};
  edge.covariance = std::move(covariance);
  return edge;
}

}  // namespace

Result<std::vector<float>> root_sigmas(const MapLayout& layout, FrameId root) {
  const auto place = layout.place(root);
  if (!place) return {Reason::NO_SUCH_FRAME, "the layout does not have frame " + root.to_string()};
  const MapLayout::Run& run = layout.runs[place->run];
  std::uint32_t nearest = place->point;
  if (nearest > run.first && layout.points[nearest].index - root.index > root.index - layout.points[nearest - 1].index)
    --nearest;
  const FrameId start = layout.frame_of(run, nearest);

  std::vector<std::uint32_t> numbers;  // of the points of the root's part
  std::vector<FrameId> frames;
  std::vector<client::RelaxationEdge> edges;
  std::vector<bool> in_part(layout.points.size(), false);
  for (const MapLayout::Run& other : layout.runs) {
    if (other.part != run.part) continue;
    for (std::uint32_t k = other.first; k < other.end; ++k) {
      numbers.push_back(k);
      frames.push_back(layout.frame_of(other, k));
      in_part[k] = true;
      const MapLayout::Point& point = layout.points[k];
      if (k == other.first || (point.flags & kNotPulling)) continue;
      edges.push_back(edge_between(
          layout, layout.frame_of(other, k - 1), k - 1, frames.back(), k,
          point.flags & kCarried ? client::carried_covariance()
                                 : client::isotropic_covariance(point.translation_variance, point.rotation_variance)));
    }
  }
  for (const MapLayout::Closure& closure : layout.closures)
    if (closure.in_force() && in_part[closure.at_a] && in_part[closure.at_b])
      edges.push_back(
          edge_between(layout, closure.a, closure.at_a, closure.id.frame, closure.at_b,
                       client::isotropic_covariance(closure.translation_variance, closure.rotation_variance)));
  const std::vector<double> of_frames = client::position_sigmas(frames, edges, start);
  std::vector<float> sigmas(layout.points.size(), std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < numbers.size(); ++i) sigmas[numbers[i]] = static_cast<float>(of_frames[i]);
  return sigmas;
}

}  // namespace relmap::console
