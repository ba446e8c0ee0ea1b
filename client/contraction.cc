#include "client/contraction.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <unordered_map>
#include <utility>

namespace relmap::client {
namespace {

// The ends of a step of which less is known than this (square metres) are kept: a robot that was carried. Closures
// behind such a step would otherwise be carried across it, and count for nothing.
constexpr double kUnknownStep = 1;
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

double variance(const RelaxationEdge& step) { return step.covariance.topLeftCorner<3, 3>().trace(); }

// The way from a kept frame along the odometry.
struct Way {
  SE3 T;
  Matrix6 covariance = Matrix6::Zero();
  double variance = 0;         // the sum of the steps' translational variances
  std::size_t widest = kNone;  // the step with the largest

  void append(const std::vector<RelaxationEdge>& edges, std::size_t step) {
    const RelaxationEdge& edge = edges[step];
    covariance = compound_covariance(covariance, edge.T_ab, edge.covariance);
    T = (T * edge.T_ab).normalized();
    variance += client::variance(edge);
    if (widest == kNone || client::variance(edge) > client::variance(edges[widest])) widest = step;
  }
};

class Contraction {
 public:
  // `frames` ascending, `edges` between them.
  Contraction(std::vector<FrameId> frames, const std::vector<RelaxationEdge>& edges, std::size_t max_frames)
      : frames_(std::move(frames)), edges_(edges), anchor_(frames_.size()), way_(frames_.size()) {
    for (std::size_t i = 0; i < frames_.size(); ++i) index_.emplace(frames_[i], i);
    find_steps();
    const double stride = static_cast<double>(frames_.size()) / static_cast<double>(max_frames);
    std::size_t last = 0;
    double next = 0;  // where the next frame is kept, if the odometry leads there
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      if (step_to_[i] != kNone) {
        way_[i] = way_[i - 1];
        way_[i].append(edges_, step_to_[i]);
        anchor_[i] = last;
        if (static_cast<double>(i) < next && !is_beside_unknown_step(i)) continue;
        add(stretch_edge(last, i), way_[i].widest);
        stretch_to_[i] = std::exchange(way_[i], {});
      }
      anchor_[i] = last = i;
      next = std::max(next, static_cast<double>(i)) + stride;
      kept_.push_back(i);
    }
    carry_others();
  }

  std::vector<FrameId> kept() const {
    std::vector<FrameId> ids;
    for (const std::size_t i : kept_) ids.push_back(frames_[i]);
    return ids;
  }
  std::vector<RelaxationEdge> contracted;
  std::vector<std::size_t> stands_for;

  // The poses of all frames, ascending, given those of the kept ones.
  std::vector<RelaxedPose> spread(const std::vector<RelaxedPose>& kept) const {
    std::vector<RelaxedPose> poses(frames_.size());
    for (std::size_t k = 0; k < kept_.size(); ++k) {
      const std::size_t begin = kept_[k], end = k + 1 < kept_.size() ? kept_[k + 1] : frames_.size();
      const SE3& T_start = kept[k].T_component_frame;
      const auto stretch = stretch_to_.find(end);
      // By what the relaxation changed the stretch, as seen from its end.
      Vector6 changed = Vector6::Zero();
      if (stretch != stretch_to_.end())
        changed = ((T_start * stretch->second.T).inverse() * kept[k + 1].T_component_frame).log();
      poses[begin] = {frames_[begin], T_start, kept[k].component};
      for (std::size_t i = begin + 1; i < end; ++i) {
        SE3 T = T_start * way_[i].T;
        if (stretch != stretch_to_.end() && stretch->second.variance > 0) {
          const SE3 T_frame_end = way_[i].T.inverse() * stretch->second.T;
          const double share = way_[i].variance / stretch->second.variance;
          T = T * T_frame_end * SE3::exp(share * changed) * T_frame_end.inverse();
        }
        poses[i] = {frames_[i], T.normalized(), kept[k].component};
      }
    }
    return poses;
  }

 private:
  // The steps of the odometry from one frame to the next of its session.
  void find_steps() {
    step_to_.assign(frames_.size(), kNone);
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const RelaxationEdge& edge = edges_[e];
      if (edge.kind != RelaxationEdgeKind::kOdometry || edge.a.session != edge.b.session) continue;
      const std::size_t b = index_.at(edge.b);
      if (b > 0 && frames_[b - 1] == edge.a && step_to_[b] == kNone) step_to_[b] = e;
    }
  }

  bool is_beside_unknown_step(std::size_t i) const {
    const auto is_unknown = [&](std::size_t step) { return step != kNone && variance(edges_[step]) > kUnknownStep; };
    return is_unknown(step_to_[i]) || (i + 1 < frames_.size() && is_unknown(step_to_[i + 1]));
  }

  RelaxationEdge stretch_edge(std::size_t from, std::size_t to) const {
    return {frames_[from], frames_[to], way_[to].T, way_[to].covariance, RelaxationEdgeKind::kOdometry};
  }

  void add(const RelaxationEdge& edge, std::size_t of) {
    contracted.push_back(edge);
    stands_for.push_back(of);
  }

  // Carries all edges but the steps to the kept frames before their ends.
  void carry_others() {
    std::map<std::pair<std::size_t, std::size_t>, std::size_t> best;  // by kept frames: index into `contracted`
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const RelaxationEdge& edge = edges_[e];
      const std::size_t a = index_.at(edge.a), b = index_.at(edge.b);
      if (step_to_[b] == e || anchor_[a] == anchor_[b]) continue;
      const SE3 T_end = way_[b].T.inverse();
      Matrix6 covariance = compound_covariance(way_[a].covariance, edge.T_ab, edge.covariance);
      covariance = compound_covariance(covariance, T_end, inverse_covariance(way_[b].T, way_[b].covariance));
      const RelaxationEdge carried{frames_[anchor_[a]], frames_[anchor_[b]],
                                   (way_[a].T * edge.T_ab * T_end).normalized(), covariance, edge.kind};
      if (edge.kind != RelaxationEdgeKind::kLoop) {
        add(carried, e);
        continue;
      }
      const auto [known, fresh] = best.try_emplace(std::minmax(anchor_[a], anchor_[b]), contracted.size());
      if (fresh) {
        add(carried, e);
      } else if (covariance.trace() < contracted[known->second].covariance.trace()) {
        contracted[known->second] = carried;
        stands_for[known->second] = e;
      }
    }
  }

  const std::vector<FrameId> frames_;
  const std::vector<RelaxationEdge>& edges_;
  std::unordered_map<FrameId, std::size_t> index_;
  std::vector<std::size_t> step_to_;       // by frame: the edge from the frame before; kNone: there is none
  std::vector<std::size_t> anchor_;        // by frame: the kept frame from which it follows
  std::vector<Way> way_;                   // by frame: from there
  std::map<std::size_t, Way> stretch_to_;  // by kept frame: the way to it from the one before, along the odometry
  std::vector<std::size_t> kept_;
};

}  // namespace

Result<ContractedRelaxation> relax_contracted(const std::vector<FrameId>& frames,
                                              const std::vector<RelaxationEdge>& edges, std::size_t max_frames,
                                              const RelaxationOptions& options) {
  ContractedRelaxation out;
  if (frames.size() <= max_frames) {
    auto relaxed = relax(frames, edges, options);
    if (!relaxed.ok()) return relaxed.status();
    out.relaxation = *std::move(relaxed);
    out.kept = frames.size();
    out.edges = edges;
    out.stands_for.resize(edges.size());
    std::iota(out.stands_for.begin(), out.stands_for.end(), std::size_t{0});
    return out;
  }
  if (Status sound = check_graph(frames, edges); !sound.ok()) return sound;
  std::vector<FrameId> ascending = frames;
  std::sort(ascending.begin(), ascending.end());
  Contraction contraction(ascending, edges, max_frames);
  const std::vector<FrameId> kept = contraction.kept();
  auto relaxed = relax(kept, contraction.contracted, options);
  if (!relaxed.ok()) return relaxed.status();
  out.relaxation = *std::move(relaxed);
  const std::vector<RelaxedPose> poses = contraction.spread(out.relaxation.poses);
  out.relaxation.poses.clear();
  for (const FrameId frame : frames)
    out.relaxation.poses.push_back(poses[static_cast<std::size_t>(
        std::lower_bound(ascending.begin(), ascending.end(), frame) - ascending.begin())]);
  out.kept = kept.size();
  out.edges = std::move(contraction.contracted);
  out.stands_for = std::move(contraction.stands_for);
  return out;
}

}  // namespace relmap::client
