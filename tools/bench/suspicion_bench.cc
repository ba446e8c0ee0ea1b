// relmap-bench suspicion: wrong closures, put into force among true ones, and where they come when closures are ordered
// by how doubtful they are (docs/evidence.md).
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/crc32c.h"
#include "server/map/map_builder.h"
#include "server/map/suspicion.h"
#include "storage/engine/memory_engine.h"
#include "tests/support/simulated_drive.h"
#include "tools/bench/planted_closures.h"
#include "tools/bench/ride_drive.h"
#include "tools/bench/subcommand.h"
#include "tools/g2o/pose_graph.h"

namespace relmap::bench {

namespace {

constexpr SessionNumber kSuspectSession = 1;

struct SuspicionOptions {
  std::string world = "points", graph;
  std::uint64_t first_seed = 1;
  int seeds = 1;
  bool list = false;
};

// A drive with true closures, taken in step by step.
class TrueDrive {
 public:
  virtual ~TrueDrive() = default;
  virtual std::uint32_t steps() const = 0;
  virtual void step(std::uint32_t i) = 0;
  virtual void apply(const storage::JournalRecord& record) = 0;
  virtual std::shared_ptr<const storage::Graph> graph() const = 0;
  virtual std::optional<SE3> truth(FrameId frame) const = 0;
  virtual double apart() const = 0;  // metres from which two places cannot be confused by drift
};

// A map that a builder makes.
class BuiltDrive : public TrueDrive {
 public:
  BuiltDrive() {
    auto engine = std::shared_ptr<storage::Engine>(storage::make_memory_engine());
    map_ = storage::Map::open(engine, engine->acquire().or_throw(),
                              std::make_shared<storage::Budget>(std::size_t{2} << 30))
               .or_throw();
    builder_ = std::make_unique<map::MapBuilder>(*map_, storage::WordFunction{}, rba::RbaOptions{});
  }
  [[gnu::noinline]] void apply(const storage::JournalRecord& record) override { builder_->apply(++sequence_, record); }
  std::shared_ptr<const storage::Graph> graph() const override { return map_; }

 protected:
  void take_in(const Keyframe& keyframe) {
    Bytes payload = encode_keyframe(keyframe);
    const std::uint32_t crc = crc32c(payload);
    apply(storage::KeyframeRecord{kSuspectSession, crc, std::move(payload)});
  }

  std::shared_ptr<storage::Map> map_;
  std::unique_ptr<map::MapBuilder> builder_;
  std::uint64_t sequence_ = 0;
};

// Three laps of simulated points. Figures of the closures are drawn as recognition has them: most are sure, some are
// found with few points, at places that look like others or have changed.
class PointsLaps final : public BuiltDrive {
 public:
  explicit PointsLaps(std::uint64_t seed) : world_(options(seed)), random_(seed, 78, 0) {
    const Keyframe first = world_.keyframe(0);
    apply(storage::SessionRecord{kSuspectSession, first.session.name, first.session});
  }
  std::uint32_t steps() const override { return world_.size(); }
  double apart() const override { return 5; }
  std::optional<SE3> truth(FrameId frame) const override { return world_.T_world_frame(frame.index); }
  void step(std::uint32_t i) override {
    take_in(world_.keyframe(i));
    const std::uint32_t lap = world_.options().frames_per_lap;
    if (i < lap) return;
    // Stretches in which nothing is recognised, and crossings that are seen from one frame only.
    const bool crossing = i % 29 == 0, stretch = (i / 16) % 3 == 0;
    if (!(crossing || (stretch && random_.uniform() < 0.8))) return;
    const auto match = static_cast<std::uint32_t>(i % lap + lap * (random_.bits() % (i / lap)));
    auto closure = testing::simulated_closure(*map_, world_, i, {kSuspectSession, i}, match, {kSuspectSession, match});
    if (!closure) return;
    draw_figures(*closure);
    apply(*closure);
  }

 private:
  static sim::PointsWorldOptions options(std::uint64_t seed) {
    sim::PointsWorldOptions world;
    world.world_seed = world.noise_seed = seed;
    world.shape = seed % 2 == 0 ? sim::PlanShape::kFigure8 : sim::PlanShape::kRoundedRectangle;
    world.frames_per_lap = 160;
    world.frames = 3 * world.frames_per_lap + 60;
    world.step = 0.4;
    world.births = 30;
    return world;
  }
  void draw_figures(storage::ClosureProposalRecord& closure) {
    const bool poor = random_.uniform() < 0.25;
    closure.verification = storage::Verification::kStereo;
    closure.inliers = static_cast<std::uint16_t>(poor ? random_.uniform(20, 60) : random_.uniform(40, 160));
    closure.spread = static_cast<float>(poor ? random_.uniform(0.06, 0.25) : random_.uniform(0.15, 0.5));
    closure.probability =
        static_cast<float>(poor ? random_.uniform(0.06, 0.95) : 1 - 0.2 * random_.uniform() * random_.uniform());
    closure.uniqueness.known = random_.uniform() < 0.9;
    if (!closure.uniqueness.known) return;
    closure.uniqueness.runner_up = {kSuspectSession, 1};
    closure.uniqueness.runner_up_inliers =
        static_cast<std::uint16_t>(random_.uniform(0, poor ? 0.5 : 0.25) * closure.inliers);
    closure.uniqueness.differs = static_cast<float>(random_.uniform(0, poor ? 0.5 : 0.25));
  }

  sim::PointsWorld world_;
  sim::Stream random_;
};

// A recorded pose graph with its loops, all of which are true. Nothing is known of their pictures.
class GraphDrive final : public BuiltDrive {
 public:
  explicit GraphDrive(const std::string& path) : graph_(g2o::read_pose_graph(path).or_throw()) {
    std::stable_sort(graph_.loops.begin(), graph_.loops.end(), [](const auto& l, const auto& r) { return l.a < r.a; });
    header_.robot = header_.name = "recorded";
    header_.uuid.bytes[0] = 1;
    header_.camera = {400, 320, 240, 0.12, 640, 480};
    apply(storage::SessionRecord{kSuspectSession, header_.name, header_});
  }
  std::uint32_t steps() const override { return static_cast<std::uint32_t>(graph_.odometry.size()) + 1; }
  double apart() const override { return 30; }
  std::optional<SE3> truth(FrameId frame) const override { return graph_.poses[frame.index]; }
  void step(std::uint32_t i) override {
    Keyframe keyframe;
    keyframe.session = header_;
    keyframe.sequence = i;
    keyframe.time_us = 1'577'836'800'000'000 + std::int64_t{i} * 100'000;
    if (i > 0) {
      T_odom_frame_ = (T_odom_frame_ * graph_.odometry[i - 1].T_ab).normalized();
      keyframe.step_covariance =
          (Vector6() << Vector3::Constant(0.04 * 0.04), Vector3::Constant(0.003 * 0.003)).finished().asDiagonal();
      keyframe.driven_us = 100'000;
    }
    keyframe.T_odom_frame = T_odom_frame_;
    keyframe.source = i == 0 ? MotionSource::kStart : MotionSource::kVision;
    take_in(keyframe);
    for (; next_ < graph_.loops.size() && graph_.loops[next_].a <= i; ++next_) propose(graph_.loops[next_]);
  }

 private:
  void propose(const g2o::PoseGraph::Edge& loop) {
    storage::ClosureProposalRecord proposal;
    proposal.query = {kSuspectSession, loop.a};
    proposal.match = {kSuspectSession, loop.b};
    proposal.T_match_query = loop.T_ab.inverse();
    proposal.verification = storage::Verification::kImported;
    proposal.covariance = 4 * inverse_covariance(loop.T_ab, loop.covariance);
    apply(proposal);
  }

  g2o::PoseGraph graph_;
  SessionHeader header_;
  SE3 T_odom_frame_;
  std::size_t next_ = 0;
};

// Pictures of a simulated drive, through front-end, recognition and map.
class PicturesDrive final : public TrueDrive {
 public:
  explicit PicturesDrive(const sim::PictureWorldOptions& options)
      : drive_(drive_ride(options)), mapper_(begin_ride(drive_, true)) {}
  std::uint32_t steps() const override { return static_cast<std::uint32_t>(drive_.keyframes.size()); }
  double apart() const override { return 5; }
  std::shared_ptr<const storage::Graph> graph() const override { return mapper_->view(); }
  std::optional<SE3> truth(FrameId frame) const override { return drive_.truth[frame.index]; }
  void apply(const storage::JournalRecord& record) override {
    const auto later = std::chrono::steady_clock::now() + std::chrono::minutes(10);
    const Status done = mapper_->wait_applied(mapper_->submit_and_wait(record).or_throw(), later);
    if (!done.ok()) throw StatusError(done);
  }
  void step(std::uint32_t i) override { take_in(drive_, i, *mapper_); }

 private:
  const RideDrive drive_;
  const std::unique_ptr<map::Mapper> mapper_;
};

std::unique_ptr<TrueDrive> open_drive(const SuspicionOptions& options, std::uint64_t seed) {
  if (options.world == "points") return std::make_unique<PointsLaps>(seed);
  if (options.world == "graph") return std::make_unique<GraphDrive>(options.graph);
  sim::PictureWorldOptions world;
  if (options.world == "street") {
    world.seed = seed;
    world.laps = 2;
    world.step = 0.25;
    world.frames = 480;
  } else {
    world = sim::ride_options(*sim::ride_of(options.world), seed);
  }
  world.camera = sim::scaled(world.camera, 320);
  if (const Status status = world.check(); !status.ok()) throw StatusError(status);
  return std::make_unique<PicturesDrive>(world);
}

struct Suspect {
  storage::Edge edge;
  double value = 0;
  bool planted = false, wrong = false;
};

std::vector<Suspect> suspects(const TrueDrive& drive, const Planter& planter) {
  std::vector<Suspect> all;
  const auto graph = drive.graph();
  const std::uint32_t last = graph->session(kSuspectSession)->last;
  for (std::uint32_t i = 0; i <= last; ++i) {
    const auto hot = graph->hot({kSuspectSession, i});
    for (const storage::Edge& edge : hot ? hot->edges : std::vector<storage::Edge>{}) {
      if (edge.kind != storage::EdgeKind::kLoop) continue;
      const auto at_a = drive.truth(edge.a), at_b = drive.truth(edge.b);
      const bool wrong = at_a && at_b && ((at_a->inverse() * *at_b).t - edge.prior_T_ab.t).norm() > drive.apart() / 2;
      all.push_back({edge, map::suspicion_value(storage::digest_of(edge)),
                     std::ranges::count(planter.planted(), edge.id) > 0, wrong});
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Suspect& l, const Suspect& r) { return l.value > r.value; });
  return all;
}

void list(const std::vector<Suspect>& ranked, std::uint64_t seed) {
  for (std::size_t i = 0; i < ranked.size(); ++i) {
    const Suspect& s = ranked[i];
    const map::Suspicion told = map::suspicion_of(storage::digest_of(s.edge));
    std::fprintf(stderr, "seed %llu rank %zu %.3f %s %s %s:", static_cast<unsigned long long>(seed), i + 1, s.value,
                 s.planted ? "PLANTED"
                 : s.wrong ? "wrong"
                           : "true",
                 s.edge.id.to_string().c_str(), std::string(reason_name(s.edge.reason)).c_str());
    for (const map::Doubt& doubt : told.doubts) std::fprintf(stderr, " [%.2f %s]", doubt.weight, doubt.message.c_str());
    std::fprintf(stderr, "\n");
  }
}

// Plants half of them on the way, so that true closures come after them, and half at the end: of each half two alone,
// and three along a stretch.
void plant_half(Planter& planter) {
  for (const std::uint32_t length : {1u, 1u, 3u}) planter.plant(kSuspectSession, length);
}

void run(const SuspicionOptions& options, Report& report) {
  std::vector<double> planted, true_ones, in_force, first_15, first_15_of_all, last_rank, wrong_too;
  for (int k = 0; k < options.seeds; ++k) {
    const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(k);
    const auto drive = open_drive(options, seed);
    Planter planter(
        {[&](const storage::JournalRecord& record) { drive->apply(record); }, [&] { return drive->graph(); },
         [&](FrameId frame) -> std::optional<Vector3> {
           const auto truth = drive->truth(frame);
           return truth ? std::optional<Vector3>(truth->t) : std::nullopt;
         }},
        drive->apart(), seed);
    for (std::uint32_t i = 0; i < drive->steps(); ++i) {
      drive->step(i);
      if (i == drive->steps() * 2 / 3) plant_half(planter);
    }
    plant_half(planter);

    const std::vector<Suspect> ranked = suspects(*drive, planter);
    if (options.list) list(ranked, seed);
    std::vector<Suspect> forced;
    for (const Suspect& s : ranked)
      if (s.edge.state == storage::EdgeState::kAccepted) forced.push_back(s);
    const auto found = [](const std::vector<Suspect>& among) {
      return static_cast<double>(std::count_if(among.begin(),
                                               among.begin() + std::min<std::ptrdiff_t>(15, std::ssize(among)),
                                               [](const Suspect& s) { return s.planted; }));
    };
    double last = 0;
    for (std::size_t i = 0; i < forced.size(); ++i)
      if (forced[i].planted) last = static_cast<double>(i + 1);
    planted.push_back(static_cast<double>(std::ranges::count_if(forced, &Suspect::planted)));
    true_ones.push_back(
        static_cast<double>(std::ranges::count_if(ranked, [](const Suspect& s) { return !s.planted && !s.wrong; })));
    wrong_too.push_back(
        static_cast<double>(std::ranges::count_if(forced, [](const Suspect& s) { return !s.planted && s.wrong; })));
    in_force.push_back(static_cast<double>(forced.size()));
    first_15.push_back(found(forced));
    first_15_of_all.push_back(found(ranked));
    last_rank.push_back(last);
  }
  report.add("planted_of_seed", planted, "wrong closures that were put into force");
  report.add("true_of_seed", true_ones, "true closures, in force or not");
  report.add("in_force_of_seed", in_force, "closures in force, the planted ones among them");
  report.add("wrong_besides_of_seed", wrong_too, "wrong closures in force that recognition made by itself");
  report.add("first_15_of_seed", first_15, "planted ones among the 15 most suspicious closures in force");
  report.add("first_15_of_all_of_seed", first_15_of_all, "among the 15 most suspicious of all closures");
  report.add("last_rank_of_seed", last_rank, "rank of the last planted one among closures in force");
  double sum = 0, found = 0, found_of_all = 0;
  for (std::size_t i = 0; i < planted.size(); ++i)
    sum += planted[i], found += first_15[i], found_of_all += first_15_of_all[i];
  report.add("planted", sum, "in all drives");
  report.add("first_15", found, "of them among the 15 most suspicious closures in force of their drive");
  report.add("first_15_of_all", found_of_all, "of them among the 15 most suspicious of all closures of their drive");
}

}  // namespace

Run declare_suspicion(CLI::App& app) {
  const auto options = std::make_shared<SuspicionOptions>();
  app.add_option("--world", options->world,
                 "points: three simulated laps; street: pictures of two laps of a street; graph: a recorded pose graph "
                 "whose loops are true; or pictures of a ride, as in relmap-sim pictures --ride")
      ->check(CLI::IsMember(
          {"points", "graph", "street", "lift", "lift-alike", "lift-ramp", "train", "escalator", "alike"}))
      ->capture_default_str();
  app.add_option("--graph", options->graph, "the g2o file of --world graph");
  app.add_option("--seeds", options->seeds, "number of drives")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--first-seed", options->first_seed, "seed of the first drive")->capture_default_str();
  app.add_flag("--list", options->list, "list every closure with its doubts on standard error");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
