#include "client/relaxation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>
#include <string>
#include <unordered_map>

#include "client/graph_relaxation.h"

namespace relmap::client {
namespace {

using Numbers = std::unordered_map<FrameId, int>;  // of frames, from 0

Status check_edge(const RelaxationEdge& edge, const Numbers& numbers) {
  const auto name = [&] { return "edge " + edge.a.to_string() + " -> " + edge.b.to_string(); };
  if (!numbers.contains(edge.a) || !numbers.contains(edge.b))
    return {Reason::INVALID_ARGUMENT, name() + " leads out of the frames"};
  if (edge.a == edge.b) return {Reason::INVALID_ARGUMENT, name() + " joins a frame to itself"};
  if (!edge.T_ab.R.allFinite() || !edge.T_ab.t.allFinite() || !edge.covariance.allFinite())
    return {Reason::NOT_FINITE, name()};
  if ((edge.T_ab.R * edge.T_ab.R.transpose() - Matrix3::Identity()).norm() > 1e-6)
    return {Reason::BAD_ROTATION, name()};
  if (Eigen::LLT<Matrix6>(edge.covariance).info() != Eigen::Success ||
      !edge.covariance.isApprox(edge.covariance.transpose(), 1e-6))
    return {Reason::BAD_COVARIANCE, name()};
  return {};
}

// Numbers the frames in their order, and checks them and the edges.
Result<Numbers> number_frames(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges) {
  Numbers numbers;
  numbers.reserve(frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k)
    if (!numbers.emplace(frames[k], static_cast<int>(k)).second)
      return {Reason::INVALID_ARGUMENT, "frame " + frames[k].to_string() + " is given twice"};
  for (const RelaxationEdge& edge : edges)
    if (Status sound = check_edge(edge, numbers); !sound.ok()) return sound;
  return numbers;
}

// The component of each frame, numbered by their first frames.
std::vector<int> find_components(int frames, const std::vector<std::pair<int, int>>& joined, int& count) {
  std::vector<int> parent(static_cast<std::size_t>(frames));
  std::iota(parent.begin(), parent.end(), 0);
  const auto up = [&](int k) -> int& { return parent[static_cast<std::size_t>(k)]; };
  const auto root = [&](int k) {
    while (up(k) != k) k = up(k) = up(up(k));
    return k;
  };
  for (const auto& [x, y] : joined) {
    const int a = root(x), b = root(y);
    up(std::max(a, b)) = std::min(a, b);  // so that the root is the first frame of its component
  }
  std::vector<int> component(parent.size());
  count = 0;
  for (int k = 0; k < frames; ++k) {
    const int first = root(k);
    component[static_cast<std::size_t>(k)] = first == k ? count++ : component[static_cast<std::size_t>(first)];
  }
  return component;
}

}  // namespace

Status check_graph(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges) {
  return number_frames(frames, edges).status();
}

Result<Relaxation> relax(const std::vector<FrameId>& frames, const std::vector<RelaxationEdge>& edges,
                         const RelaxationOptions& options) {
  const auto numbers = number_frames(frames, edges);
  if (!numbers.ok()) return numbers.status();
  std::vector<std::pair<int, int>> ends;
  ends.reserve(edges.size());
  for (const RelaxationEdge& edge : edges) ends.emplace_back(numbers->at(edge.a), numbers->at(edge.b));

  Relaxation out;
  const std::vector<int> component = find_components(static_cast<int>(frames.size()), ends, out.components);
  std::vector<std::size_t> ascending(frames.size());
  std::iota(ascending.begin(), ascending.end(), std::size_t{0});
  std::sort(ascending.begin(), ascending.end(), [&](std::size_t x, std::size_t y) { return frames[x] < frames[y]; });
  std::vector<PoseGraph> graphs(static_cast<std::size_t>(out.components));
  std::vector<std::vector<std::size_t>> members(graphs.size());
  std::vector<int> place(frames.size());  // of each frame within its component
  for (const std::size_t k : ascending) {
    const auto c = static_cast<std::size_t>(component[k]);
    place[k] = graphs[c].frames++;
    members[c].push_back(k);
  }
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const RelaxationEdge& edge = edges[e];
    const int a = place[static_cast<std::size_t>(ends[e].first)], b = place[static_cast<std::size_t>(ends[e].second)];
    graphs[static_cast<std::size_t>(component[static_cast<std::size_t>(ends[e].first)])].links.push_back(
        {a, b, edge.T_ab, edge.covariance, edge.kind == RelaxationEdgeKind::kLoop});
  }
  out.poses.resize(frames.size());
  for (std::size_t c = 0; c < graphs.size(); ++c) {
    auto relaxed = relax_graph(graphs[c], options);
    if (!relaxed.ok()) return relaxed.status();
    graphs[c] = {};
    out.initial_cost += relaxed->initial_cost;
    out.final_cost += relaxed->final_cost;
    out.iterations = std::max(out.iterations, relaxed->iterations);
    out.converged = out.converged && relaxed->converged;
    // Of the frames in the order given, the first one has the identity.
    const std::size_t first = *std::min_element(members[c].begin(), members[c].end());
    const bool is_first = first == members[c].front();
    const SE3 T_first_lowest = relaxed->poses[static_cast<std::size_t>(place[first])].inverse();
    for (std::size_t m = 0; m < members[c].size(); ++m) {
      const SE3& pose = relaxed->poses[m];
      const std::size_t k = members[c][m];
      out.poses[k] = {frames[k], is_first ? pose : (T_first_lowest * pose).normalized(), static_cast<int>(c)};
    }
    if (!is_first) out.poses[first].T_component_frame = SE3();
  }
  return out;
}

}  // namespace relmap::client
