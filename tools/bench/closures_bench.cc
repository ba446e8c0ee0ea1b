// Loop closures of a recorded pose graph, some of them false, proposed to a map one after the other as place
// recognition would: which does it take in, and which does it refuse? docs/decisions.md, The method.
#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "proto/crc32c.h"
#include "server/map/map_builder.h"
#include "storage/budget.h"
#include "storage/memory_engine.h"
#include "tools/bench/subcommand.h"
#include "tools/g2o/pose_graph.h"

namespace relmap::bench {

namespace {

constexpr SessionNumber kSession = 1;
constexpr double kFalseBeyond = 10, kTrueWithin = 3;  // metres between the ends, by the truth

struct Options {
  std::string graph, truth;
  std::uint32_t truth_every = 10;
  double step_metres = 0.04, step_radians = 0.003, loop_scale = 2;
};

PoseGraph read(const std::string& path) { return read_pose_graph(path).or_throw(); }

class Replay {
 public:
  Replay(const PoseGraph& graph, const Options& options) : graph_(graph), options_(options) {
    auto engine = std::shared_ptr<Engine>(make_memory_engine());
    map_ = Map::open(engine, engine->acquire().or_throw(), std::make_shared<Budget>(std::size_t{2} << 30)).or_throw();
    builder_ = std::make_unique<MapBuilder>(*map_, WordFunction{}, RbaOptions{});
    header_.robot = "recorded";
    header_.name = "pose graph";
    header_.uuid.bytes[0] = 1;
    header_.camera = {400, 320, 240, 0.12, 640, 480};
  }

  void run() {
    apply(SessionRecord{kSession, header_.name, header_});
    add_keyframe(0, SE3());
    std::size_t next = 0;
    SE3 T_odom_frame;
    for (const PoseGraph::Edge& step : graph_.odometry) {
      if (step.a != last_) throw std::runtime_error("the odometry has a gap at " + std::to_string(step.a));
      T_odom_frame = T_odom_frame * step.T_ab;
      add_keyframe(step.b, T_odom_frame);
      for (; next < graph_.loops.size() && graph_.loops[next].a <= step.b; ++next) propose(graph_.loops[next]);
    }
  }

  // Of graph.loops, in their order; nothing where the map took no such proposal.
  std::vector<std::optional<Edge>> closures() const {
    std::vector<std::optional<Edge>> found;
    for (const PoseGraph::Edge& loop : graph_.loops) {
      const auto hot = map_->hot({kSession, loop.a});
      std::optional<Edge> closure;
      for (const Edge& edge : hot ? hot->edges : std::vector<Edge>{})
        if (edge.kind == EdgeKind::kLoop && edge.a == FrameId{kSession, loop.b}) closure = edge;
      found.push_back(std::move(closure));
    }
    return found;
  }
  const std::vector<double>& proposal_us() const { return proposal_us_; }

 private:
  // GCC 12 would take the alternatives that a record does not hold for uninitialised.
  [[gnu::noinline]] void apply(const JournalRecord& record) { builder_->apply(++sequence_, record); }

  void add_keyframe(std::uint32_t index, const SE3& T_odom_frame) {
    Keyframe keyframe;
    keyframe.session = header_;
    keyframe.sequence = last_ = index;
    keyframe.time_us = 1'577'836'800'000'000 + std::int64_t{index} * 100'000;
    keyframe.T_odom_frame = T_odom_frame.normalized();
    keyframe.source = index == 0 ? MotionSource::kStart : MotionSource::kVision;
    if (index > 0) {
      Vector6 sigma;
      sigma << Vector3::Constant(options_.step_metres), Vector3::Constant(options_.step_radians);
      keyframe.step_covariance = sigma.cwiseAbs2().asDiagonal();
      keyframe.driven_us = 100'000;
    }
    Bytes payload = encode_keyframe(keyframe);
    const std::uint32_t crc = crc32c(payload);
    apply(KeyframeRecord{kSession, crc, std::move(payload)});
  }

  void propose(const PoseGraph::Edge& loop) {
    ClosureProposalRecord proposal;
    proposal.query = {kSession, loop.a};
    proposal.match = {kSession, loop.b};
    proposal.T_match_query = loop.T_ab.inverse();
    proposal.verification = Verification::kImported;
    proposal.covariance = options_.loop_scale * options_.loop_scale * inverse_covariance(loop.T_ab, loop.covariance);
    const auto begin = std::chrono::steady_clock::now();
    apply(proposal);
    proposal_us_.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  }

  const PoseGraph& graph_;
  const Options& options_;
  std::unique_ptr<Map> map_;
  std::unique_ptr<MapBuilder> builder_;
  SessionHeader header_;
  std::uint64_t sequence_ = 0;
  std::uint32_t last_ = 0;
  std::vector<double> proposal_us_;
};

struct Tally {
  double all = 0, kept = 0;
  void add(bool accepted) { ++all, kept += accepted; }
};

void run(const Options& options, Report& report) {
  const PoseGraph graph = read(options.graph);
  const PoseGraph truth = options.truth.empty() ? PoseGraph{} : read(options.truth);
  Replay replay(graph, options);
  replay.run();

  const auto truth_of = [&](std::uint32_t id) -> std::optional<Vector3> {
    const auto found = std::lower_bound(truth.ids.begin(), truth.ids.end(), id / options.truth_every);
    if (found == truth.ids.end() || *found != id / options.truth_every) return std::nullopt;
    return truth.poses[static_cast<std::size_t>(found - truth.ids.begin())].t;
  };
  Tally right, wrong, between, all;
  double quarantined = 0, contradicted = 0, edges = 0;
  const auto closures = replay.closures();
  for (std::size_t i = 0; i < closures.size(); ++i) {
    const bool accepted = closures[i] && closures[i]->state == EdgeState::kAccepted;
    all.add(accepted);
    edges += accepted && closures[i]->carries;
    quarantined += closures[i] && closures[i]->state == EdgeState::kQuarantined;
    contradicted += closures[i] && closures[i]->reason == Reason::CONTRADICTS_MOTION;
    const auto a = truth_of(graph.ids[graph.loops[i].a]), b = truth_of(graph.ids[graph.loops[i].b]);
    if (!a || !b) continue;
    const double apart = (*a - *b).norm();
    (apart > kFalseBeyond ? wrong : apart < kTrueWithin ? right : between).add(accepted);
  }
  report.add("frames", static_cast<double>(graph.ids.size()), "of the pose graph");
  report.add("loops", all.all, "proposed, one after the other");
  report.add("self_edges", static_cast<double>(graph.self_edges.size()), "from a frame to itself: refused");
  report.add("kept", all.kept, "accepted at the end");
  report.add("carry", edges, "of them edges of the graph");
  report.add("quarantined", quarantined, "accepted once, and outvoted");
  report.add("contradicted", contradicted, "by the robot's own motion");
  if (!options.truth.empty()) {
    report.add("true_loops", right.all, "whose ends are less than 3 m apart");
    report.add("true_kept", right.kept, "");
    report.add("false_loops", wrong.all, "whose ends are more than 10 m apart");
    report.add("false_refused", wrong.all - wrong.kept, "");
    report.add("between_loops", between.all, "neither");
    report.add("between_kept", between.kept, "");
  }
  report.add("proposal_mean_us", mean(replay.proposal_us()), "taking a proposal in, its relaxation included");
  report.add("proposal_p99_us", quantile(replay.proposal_us(), 0.99), "");
}

}  // namespace

Run declare_closures(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("graph", options->graph, "g2o file of poses in the plane, odometry, and loops to propose")->required();
  app.add_option("--truth", options->truth, "g2o file with the true positions");
  app.add_option("--truth-every", options->truth_every, "frames of the graph between two true positions")
      ->capture_default_str();
  app.add_option("--step-metres", options->step_metres, "standard deviation of a step of the odometry")
      ->capture_default_str();
  app.add_option("--step-radians", options->step_radians, "likewise")->capture_default_str();
  app.add_option("--loop-scale", options->loop_scale, "loops' standard deviations are the file's, times this")
      ->capture_default_str();
  app.footer(
      "Example:\n"
      "  relmap-bench closures Bovisa04_odometry_bow_tr.g2o --truth Bovisa04_GT_GPS.g2o");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
