// Loop closures of a recorded pose graph, some of them false, proposed to a map one after the other as place
// recognition would: which does it take in, and which does it refuse? docs/decisions/closures.md.
#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/crc32c.h"
#include "server/map/map_builder.h"
#include "storage/engine/memory_engine.h"
#include "storage/memory/budget.h"
#include "tools/bench/look_alikes.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"
#include "tools/g2o/pose_graph.h"

namespace relmap::bench {

namespace {

constexpr SessionNumber kReplayedSession = 1;
constexpr double kFalseBeyond = 10, kTrueWithin = 3;  // metres between the ends, by the truth

struct ClosuresOptions {
  std::string graph, truth;
  std::uint32_t truth_every = 10;
  bool loops_are_true = false;
  std::uint32_t look_alikes = 0;  // places that look like others, of which the graph's own loops know nothing
  std::uint64_t seed = 1;
  map::ConsistencyRules rules;
  bool rules_one_by_one = false, folds = false;
  double step_metres = 0.04, step_radians = 0.003, loop_scale = 2;
};

g2o::PoseGraph read(const std::string& path) { return g2o::read_pose_graph(path).or_throw(); }

class Replay {
 public:
  Replay(const g2o::PoseGraph& graph, const ClosuresOptions& options, const map::ConsistencyRules& rules)
      : graph_(graph), options_(options) {
    auto engine = std::shared_ptr<storage::Engine>(storage::make_memory_engine());
    map_ = storage::Map::open(engine, engine->acquire().or_throw(),
                              std::make_shared<storage::Budget>(std::size_t{2} << 30))
               .or_throw();
    builder_ = std::make_unique<map::MapBuilder>(*map_, storage::WordFunction{}, rba::RbaOptions{},
                                                 map::kLoopEdgeSpacing, rules);
    header_.robot = "recorded";
    header_.name = "pose graph";
    header_.uuid.bytes[0] = 1;
    header_.camera = {400, 320, 240, 0.12, 640, 480};
  }

  void run() {
    apply(storage::SessionRecord{kReplayedSession, header_.name, header_});
    add_keyframe(0, SE3());
    std::size_t next = 0;
    SE3 T_odom_frame;
    for (const g2o::PoseGraph::Edge& step : graph_.odometry) {
      if (step.a != last_) throw std::runtime_error("the odometry has a gap at " + std::to_string(step.a));
      T_odom_frame = T_odom_frame * step.T_ab;
      add_keyframe(step.b, T_odom_frame);
      for (; next < graph_.loops.size() && graph_.loops[next].a <= step.b; ++next) propose(graph_.loops[next]);
    }
  }

  // One entry for each of graph.loops; nullopt if the map refused the proposal.
  std::vector<std::optional<storage::Edge>> closures() const {
    std::vector<std::optional<storage::Edge>> found;
    for (const g2o::PoseGraph::Edge& loop : graph_.loops) {
      const auto hot = map_->hot({kReplayedSession, loop.a});
      std::optional<storage::Edge> closure;
      for (const storage::Edge& edge : hot ? hot->edges : std::vector<storage::Edge>{})
        if (edge.kind == storage::EdgeKind::kLoop && edge.a == FrameId{kReplayedSession, loop.b}) closure = edge;
      found.push_back(std::move(closure));
    }
    return found;
  }
  const std::vector<double>& proposal_us() const { return proposal_us_; }

 private:
  // GCC 12 would take the alternatives that a record does not hold for uninitialised.
  [[gnu::noinline]] void apply(const storage::JournalRecord& record) { builder_->apply(++sequence_, record); }

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
    apply(storage::KeyframeRecord{kReplayedSession, crc, std::move(payload)});
  }

  void propose(const g2o::PoseGraph::Edge& loop) {
    storage::ClosureProposalRecord proposal;
    proposal.query = {kReplayedSession, loop.a};
    proposal.match = {kReplayedSession, loop.b};
    proposal.T_match_query = loop.T_ab.inverse();
    proposal.verification = storage::Verification::kImported;
    proposal.covariance = options_.loop_scale * options_.loop_scale * inverse_covariance(loop.T_ab, loop.covariance);
    const auto begin = std::chrono::steady_clock::now();
    apply(proposal);
    proposal_us_.push_back(microseconds_since(begin));
  }

  const g2o::PoseGraph& graph_;
  const ClosuresOptions& options_;
  std::unique_ptr<storage::Map> map_;
  std::unique_ptr<map::MapBuilder> builder_;
  SessionHeader header_;
  std::uint64_t sequence_ = 0;
  std::uint32_t last_ = 0;
  std::vector<double> proposal_us_;
};

enum class Truth { kTrue, kFalse, kBetween, kUnknown };

// Whether a loop is true: by the true distance of its ends, or by its origin.
std::vector<Truth> truths(const g2o::PoseGraph& graph, const ClosuresOptions& options) {
  const g2o::PoseGraph truth = options.truth.empty() ? g2o::PoseGraph{} : read(options.truth);
  const auto truth_of = [&](std::uint32_t id) -> std::optional<Vector3> {
    const auto found = std::lower_bound(truth.ids.begin(), truth.ids.end(), id / options.truth_every);
    if (found == truth.ids.end() || *found != id / options.truth_every) return std::nullopt;
    return truth.poses[static_cast<std::size_t>(found - truth.ids.begin())].t;
  };
  std::vector<Truth> result;
  for (std::size_t i = 0; i < graph.loops.size(); ++i) {
    if (options.loops_are_true) {
      result.push_back(Truth::kTrue);
      continue;
    }
    const auto a = truth_of(graph.ids[graph.loops[i].a]), b = truth_of(graph.ids[graph.loops[i].b]);
    const double apart = a && b ? (*a - *b).norm() : -1;
    result.push_back(apart < 0              ? Truth::kUnknown
                     : apart > kFalseBeyond ? Truth::kFalse
                     : apart < kTrueWithin  ? Truth::kTrue
                                            : Truth::kBetween);
  }
  return result;
}

// False loops among the graph's own, in the order in which they are proposed.
void mix_in(const std::vector<g2o::PoseGraph::Edge>& alike, g2o::PoseGraph& graph, std::vector<Truth>& truth) {
  std::vector<std::pair<g2o::PoseGraph::Edge, Truth>> loops;
  for (std::size_t i = 0; i < graph.loops.size(); ++i) loops.emplace_back(graph.loops[i], truth[i]);
  for (const g2o::PoseGraph::Edge& loop : alike) loops.emplace_back(loop, Truth::kFalse);
  std::stable_sort(loops.begin(), loops.end(), [](const auto& x, const auto& y) { return x.first.a < y.first.a; });
  graph.loops.clear();
  truth.clear();
  for (const auto& [loop, is] : loops) {
    graph.loops.push_back(loop);
    truth.push_back(is);
  }
}

struct Tally {
  double all = 0, kept = 0;
  void add(bool accepted) { ++all, kept += accepted; }
  double refused() const { return all - kept; }
};

struct Outcome {
  Tally right, wrong, between, all;
  double quarantined = 0, contradicted = 0, carried = 0, edges = 0;
  Tally right_of_half[2], wrong_of_half[2];  // of the first and the second half of the drive
  std::vector<double> proposal_us;
};

Outcome replay(const g2o::PoseGraph& graph, const std::vector<Truth>& truth, const ClosuresOptions& options,
               const map::ConsistencyRules& rules) {
  Replay replay(graph, options, rules);
  replay.run();
  Outcome outcome;
  const auto closures = replay.closures();
  for (std::size_t i = 0; i < closures.size(); ++i) {
    const bool accepted = closures[i] && closures[i]->state == storage::EdgeState::kAccepted;
    outcome.all.add(accepted);
    outcome.edges += accepted && closures[i]->carries;
    outcome.carried += accepted && closures[i]->carried.session != 0;
    outcome.quarantined += closures[i] && closures[i]->state == storage::EdgeState::kQuarantined;
    outcome.contradicted += closures[i] && closures[i]->reason == Reason::CONTRADICTS_MOTION;
    const std::size_t half = graph.loops[i].a >= graph.ids.size() / 2;
    if (truth[i] == Truth::kTrue) outcome.right.add(accepted), outcome.right_of_half[half].add(accepted);
    if (truth[i] == Truth::kFalse) outcome.wrong.add(accepted), outcome.wrong_of_half[half].add(accepted);
    if (truth[i] == Truth::kBetween) outcome.between.add(accepted);
  }
  outcome.proposal_us = replay.proposal_us();
  return outcome;
}

struct Variant {
  std::string name, meaning;
  map::ConsistencyRules rules;
};

// The shipped rules without one of them.
std::vector<Variant> one_by_one() {
  std::vector<Variant> variants{{"all", "all rules", {}}};
  const auto add = [&](const char* name, const char* meaning, auto change) {
    variants.push_back({name, meaning, {}});
    change(variants.back().rules);
  };
  add("no_motion", "whatever the odometry says", [](map::ConsistencyRules& r) { r.motion = false; });
  add("no_rides", "nobody is ever carried", [](map::ConsistencyRules& r) { r.rides = false; });
  add("one_place", "pictures of one moment are many witnesses", [](map::ConsistencyRules& r) { r.moved = 0; });
  add("no_coarse", "whatever does not agree is an opponent", [](map::ConsistencyRules& r) { r.coarse = false; });
  add("reach_20", "witnesses 20 edges away at most", [](map::ConsistencyRules& r) { r.reach = 20; });
  add("no_drift", "odometry knows how far it has drifted",
      [](map::ConsistencyRules& r) { r.drift_share = r.drift_radians = 0; });
  return variants;
}

void report_rules(const g2o::PoseGraph& graph, const std::vector<Truth>& truth, const ClosuresOptions& options,
                  Report& report) {
  for (const Variant& variant : one_by_one()) {
    const Outcome outcome = replay(graph, truth, options, variant.rules);
    report.add(variant.name + "_kept", outcome.all.kept, variant.meaning);
    report.add(variant.name + "_true_kept", outcome.right.kept, "");
    report.add(variant.name + "_false_refused", outcome.wrong.refused(), "");
  }
}

// Thresholds chosen on one half of the drive and judged on the other.
void report_folds(const g2o::PoseGraph& graph, const std::vector<Truth>& truth, const ClosuresOptions& options,
                  Report& report) {
  std::vector<std::pair<map::ConsistencyRules, Outcome>> tried;
  for (const std::uint32_t reach : {20u, 50u, 100u, 200u})
    for (const double drift : {0.0, 0.005, 0.01, 0.02, 0.04}) {
      map::ConsistencyRules rules;
      rules.reach = reach;
      rules.drift_share = drift;
      rules.drift_radians = 0.03 * drift;
      tried.emplace_back(rules, replay(graph, truth, options, rules));
    }
  double refused = 0, kept = 0;
  for (const int judged : {0, 1}) {
    const int chosen_on = 1 - judged;
    const auto score = [&](const Outcome& outcome) {
      const Tally &right = outcome.right_of_half[chosen_on], &wrong = outcome.wrong_of_half[chosen_on];
      return right.kept / std::max(right.all, 1.0) + wrong.refused() / std::max(wrong.all, 1.0);
    };
    const auto best = std::max_element(tried.begin(), tried.end(),
                                       [&](const auto& x, const auto& y) { return score(x.second) < score(y.second); });
    const std::string name = judged == 0 ? "first" : "second";
    report.add(name + "_half_reach", best->first.reach, "chosen on the other half, judged on this one");
    report.add(name + "_half_drift_share", best->first.drift_share, "likewise");
    kept += best->second.right_of_half[judged].kept;
    refused += best->second.wrong_of_half[judged].refused();
  }
  report.add("folds_true_kept", kept, "of all, each half by what the other chose");
  report.add("folds_false_refused", refused, "likewise");
}

void run(const ClosuresOptions& options, Report& report) {
  g2o::PoseGraph graph = read(options.graph);
  std::vector<Truth> truth = truths(graph, options);
  mix_in(look_alikes(graph, options.look_alikes, options.seed), graph, truth);
  if (options.rules_one_by_one) return report_rules(graph, truth, options, report);
  if (options.folds) return report_folds(graph, truth, options, report);

  const Outcome outcome = replay(graph, truth, options, options.rules);
  report.add("frames", static_cast<double>(graph.ids.size()), "of the pose graph");
  report.add("loops", outcome.all.all, "proposed, one after the other");
  report.add("self_edges", static_cast<double>(graph.self_edges.size()), "from a frame to itself: refused");
  report.add("kept", outcome.all.kept, "accepted at the end");
  report.add("carry", outcome.edges, "of them edges of the graph");
  report.add("quarantined", outcome.quarantined, "accepted once, and outvoted");
  report.add("contradicted", outcome.contradicted, "by the robot's own motion");
  report.add("carried", outcome.carried, "kept because the robot was carried, it is said");
  if (outcome.right.all + outcome.wrong.all > 0) {
    report.add("true_loops", outcome.right.all, "whose ends are less than 3 m apart");
    report.add("true_kept", outcome.right.kept, "");
    report.add("false_loops", outcome.wrong.all, "whose ends are more than 10 m apart");
    report.add("false_refused", outcome.wrong.refused(), "");
    report.add("between_loops", outcome.between.all, "neither");
    report.add("between_kept", outcome.between.kept, "");
  }
  report.add("proposal_mean_us", mean(outcome.proposal_us), "taking a proposal in, its relaxation included");
  report.add("proposal_p99_us", quantile(outcome.proposal_us, 0.99), "");
}

}  // namespace

Run declare_closures(CLI::App& app) {
  auto options = std::make_shared<ClosuresOptions>();
  app.add_option("graph", options->graph, "g2o file of poses in the plane, odometry, and loops to propose")->required();
  app.add_option("--truth", options->truth, "g2o file with the true positions");
  app.add_option("--truth-every", options->truth_every, "frames of the graph between two true positions")
      ->capture_default_str();
  app.add_option("--step-metres", options->step_metres, "standard deviation of the translation of an odometry step")
      ->capture_default_str();
  app.add_option("--step-radians", options->step_radians, "standard deviation of the rotation of an odometry step")
      ->capture_default_str();
  app.add_option("--loop-scale", options->loop_scale, "factor for the file's standard deviations of loops")
      ->capture_default_str();
  app.add_flag("--loops-are-true", options->loops_are_true,
               "all loops of the file are true, so that no --truth is needed");
  app.add_option(
         "--look-alikes", options->look_alikes,
         "number of stretches of false loops to add; in each, places along one stretch look like those along another")
      ->capture_default_str();
  app.add_option("--seed", options->seed, "seed of the look-alikes")->capture_default_str();
  app.add_option("--reach", options->rules.reach, "compare closures that are at most so many edges apart")
      ->capture_default_str();
  app.add_option("--drift", options->rules.drift_share,
                 "drift of the odometry: standard deviation as a share of the length")
      ->capture_default_str();
  auto* const rules =
      app.add_flag("--rules", options->rules_one_by_one, "measure what each rule contributes: all rules without it");
  app.add_flag("--folds", options->folds, "choose thresholds on each half of the drive, and judge them on the other")
      ->excludes(rules);
  app.footer(
      "Examples:\n"
      "  relmap-bench closures Bovisa04_odometry_bow_tr.g2o --truth Bovisa04_GT_GPS.g2o\n"
      "  relmap-bench closures kitti_00.g2o --loops-are-true --look-alikes 40 --rules");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
