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
#include "tests/support/stored_map.h"
#include "tools/bench/planted_closures.h"
#include "tools/bench/ride_drive.h"
#include "tools/bench/subcommand.h"
#include "tools/g2o/pose_graph.h"

namespace relmap::bench {

namespace {

constexpr SessionNumber kSuspectSession = 1;

struct SuspicionOptions {
  std::string world = "points", graph, folder;
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
  virtual void commit() = 0;         // makes what it is now durable, if it is kept in a folder
};

// A map that a builder makes.
class BuiltDrive : public TrueDrive {
 public:
  // `folder`: the data folder of a daemon that is made of it; empty: it is in memory.
  explicit BuiltDrive(const std::string& folder = "") {
    if (folder.empty()) {
      auto engine = std::shared_ptr<storage::Engine>(storage::make_memory_engine());
      map_ = storage::Map::open(engine, engine->acquire().or_throw(),
                                std::make_shared<storage::Budget>(std::size_t{2} << 30))
                 .or_throw();
    } else {
      map_ = testing::make_stored_map(folder);
    }
    builder_ = std::make_unique<map::MapBuilder>(*map_, storage::WordFunction{}, rba::RbaOptions{});
  }
  [[gnu::noinline]] void apply(const storage::JournalRecord& record) override { builder_->apply(++sequence_, record); }
  std::shared_ptr<const storage::Graph> graph() const override { return map_; }
  void commit() override {
    if (const Status status = map_->commit(); !status.ok()) throw StatusError(status);
  }

 protected:
  void take_in(const Keyframe& keyframe, SessionNumber session = kSuspectSession) {
    Bytes payload = encode_keyframe(keyframe);
    const std::uint32_t crc = crc32c(payload);
    apply(storage::KeyframeRecord{session, crc, std::move(payload)});
  }

  std::shared_ptr<storage::Map> map_;
  std::unique_ptr<map::MapBuilder> builder_;
  std::uint64_t sequence_ = 0;
};

// The figures of a closure, drawn as recognition has them: most are sure, some are found with few points, at places
// that look like others or have changed.
void draw_figures(sim::Stream& random, storage::ClosureProposalRecord& closure) {
  const bool poor = random.uniform() < 0.25;
  closure.verification = storage::Verification::kStereo;
  closure.inliers = static_cast<std::uint16_t>(poor ? random.uniform(20, 60) : random.uniform(40, 160));
  closure.spread = static_cast<float>(poor ? random.uniform(0.06, 0.25) : random.uniform(0.15, 0.5));
  closure.probability =
      static_cast<float>(poor ? random.uniform(0.06, 0.95) : 1 - 0.2 * random.uniform() * random.uniform());
  closure.uniqueness.known = random.uniform() < 0.9;
  if (!closure.uniqueness.known) return;
  closure.uniqueness.runner_up = {kSuspectSession, 1};
  closure.uniqueness.runner_up_inliers =
      static_cast<std::uint16_t>(random.uniform(0, poor ? 0.5 : 0.25) * closure.inliers);
  closure.uniqueness.differs = static_cast<float>(random.uniform(0, poor ? 0.5 : 0.25));
}

// Stretches in which nothing is recognised, and crossings that are seen from one frame only.
bool is_recognised(std::uint32_t i, sim::Stream& random) {
  return i % 29 == 0 || ((i / 16) % 3 == 0 && random.uniform() < 0.8);
}

sim::PointsWorldOptions points_options(std::uint64_t seed) {
  sim::PointsWorldOptions world;
  world.world_seed = world.noise_seed = seed;
  world.shape = seed % 2 == 0 ? sim::PlanShape::kFigure8 : sim::PlanShape::kRoundedRectangle;
  world.frames_per_lap = 160;
  world.frames = 3 * world.frames_per_lap + 60;
  world.step = 0.4;
  world.births = 30;
  return world;
}

// Three laps of simulated points by one robot.
class PointsLaps final : public BuiltDrive {
 public:
  PointsLaps(std::uint64_t seed, const std::string& folder)
      : BuiltDrive(folder), world_(points_options(seed)), random_(seed, 78, 0) {
    const Keyframe first = world_.keyframe(0);
    apply(storage::SessionRecord{kSuspectSession, first.session.name, first.session});
  }
  std::uint32_t steps() const override { return world_.size(); }
  double apart() const override { return 5; }
  std::optional<SE3> truth(FrameId frame) const override { return world_.T_world_frame(frame.index); }
  void step(std::uint32_t i) override {
    take_in(world_.keyframe(i));
    const std::uint32_t lap = world_.options().frames_per_lap;
    if (i < lap || !is_recognised(i, random_)) return;
    const auto match = static_cast<std::uint32_t>(i % lap + lap * (random_.bits() % (i / lap)));
    auto closure = testing::simulated_closure(*map_, world_, i, {kSuspectSession, i}, match, {kSuspectSession, match});
    if (!closure) return;
    draw_figures(random_, *closure);
    apply(*closure);
  }

 private:
  sim::PointsWorld world_;
  sim::Stream random_;
};

// Three robots that drive the same lap one after the other. Their own motion says nothing of closures between them.
class PointsFleet final : public BuiltDrive {
 public:
  PointsFleet(std::uint64_t seed, const std::string& folder) : BuiltDrive(folder), random_(seed, 79, 0) {
    for (std::uint32_t robot = 0; robot < kRobots; ++robot) {
      sim::PointsWorldOptions options = points_options(seed);
      options.frames = options.frames_per_lap;
      options.noise_seed = seed + 1000 * robot;
      options.uuid.bytes[15] = static_cast<std::uint8_t>(robot + 1);
      options.session = "robot " + std::to_string(robot);
      worlds_.emplace_back(options);
    }
  }
  std::uint32_t steps() const override { return kRobots * lap(); }
  double apart() const override { return 5; }
  std::optional<SE3> truth(FrameId frame) const override { return worlds_.front().T_world_frame(frame.index); }
  void step(std::uint32_t i) override {
    const std::uint32_t robot = i / lap(), index = i % lap();
    const sim::PointsWorld& world = worlds_[robot];
    const SessionNumber session = robot + 1;
    if (index == 0) {
      const Keyframe first = world.keyframe(0);
      apply(storage::SessionRecord{session, first.session.name, first.session});
    }
    take_in(world.keyframe(index), session);
    if (robot == 0 || !is_recognised(index, random_)) return;
    const auto before = static_cast<SessionNumber>(1 + random_.bits() % robot);
    auto closure = testing::simulated_closure(*map_, world, index, {session, index}, index, {before, index});
    if (!closure) return;
    draw_figures(random_, *closure);
    apply(*closure);
  }

 private:
  static constexpr std::uint32_t kRobots = 3;
  std::uint32_t lap() const { return worlds_.front().size(); }

  std::vector<sim::PointsWorld> worlds_;
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
  void commit() override {}

 private:
  const RideDrive drive_;
  const std::unique_ptr<map::Mapper> mapper_;
};

std::unique_ptr<TrueDrive> open_drive(const SuspicionOptions& options, std::uint64_t seed) {
  if (options.world == "points") return std::make_unique<PointsLaps>(seed, options.folder);
  if (options.world == "fleet") return std::make_unique<PointsFleet>(seed, options.folder);
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
  for (const storage::Session& session : graph->sessions())
    for (std::uint32_t i = 0; i <= session.last; ++i) {
      const auto hot = graph->hot({session.number, i});
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
    const storage::ClosureDigest d = storage::digest_of(s.edge);
    std::fprintf(stderr,
                 " state=%d agreeing=%u opposing=%u motion=%d sigma=%.2f carried=%d once=%d tension=%.2f unseen=%u "
                 "inliers=%u spread=%.2f p=%.3f known=%d rival=%u differs=%.2f changed=%u/%u verified=%d;",
                 static_cast<int>(d.state), d.agreeing, d.tests.opposing, static_cast<int>(d.tests.motion),
                 static_cast<double>(d.tests.motion_sigma), d.carried, d.was_contradicted,
                 static_cast<double>(d.tension), d.unseen, d.inliers, static_cast<double>(d.spread),
                 static_cast<double>(d.probability), d.uniqueness.known, d.uniqueness.runner_up_inliers,
                 static_cast<double>(d.uniqueness.differs), d.uniqueness.changed, d.uniqueness.compared,
                 static_cast<int>(d.verification));
    for (const map::Doubt& doubt : told.doubts) std::fprintf(stderr, " [%.2f %s]", doubt.weight, doubt.message.c_str());
    std::fprintf(stderr, "\n");
  }
}

// Plants half of the ten on the way, so that true closures come after them, and half at the end: of each half two
// alone, and three along a stretch. A closure may not come into force beside another that was planted, so this is tried
// again.
void plant_half(Planter& planter) {
  constexpr int kTries = 40;
  for (const auto& [more, length] : {std::pair(2u, 1u), std::pair(3u, 3u)}) {
    const std::size_t enough = planter.planted().size() + more;
    for (int i = 0; i < kTries && planter.planted().size() < enough; ++i)
      planter.plant(std::min(length, static_cast<std::uint32_t>(enough - planter.planted().size())));
  }
}

void run(const SuspicionOptions& options, Report& report) {
  if (!options.folder.empty() && (options.seeds != 1 || (options.world != "points" && options.world != "fleet")))
    throw std::runtime_error("--folder keeps one drive, of --world points or fleet");
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
    drive->commit();
    if (!options.folder.empty())
      for (const EdgeId& edge : planter.planted()) std::fprintf(stderr, "planted %s\n", edge.to_string().c_str());

    const std::vector<Suspect> ranked = suspects(*drive, planter);
    if (options.list) list(ranked, seed);
    // Wrong ones that could not be put into force are no longer of interest.
    std::vector<Suspect> forced, others;
    for (const Suspect& s : ranked) {
      const bool accepted = s.edge.state == storage::EdgeState::kAccepted;
      if (accepted) forced.push_back(s);
      if (accepted || !s.wrong) others.push_back(s);
    }
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
    first_15_of_all.push_back(found(others));
    last_rank.push_back(last);
  }
  report.add("planted_of_seed", planted, "wrong closures that were put into force");
  report.add("true_of_seed", true_ones, "true closures, in force or not");
  report.add("in_force_of_seed", in_force, "closures in force, the planted ones among them");
  report.add("wrong_besides_of_seed", wrong_too, "wrong closures in force that recognition made by itself");
  report.add("first_15_of_seed", first_15, "planted ones among the 15 most suspicious closures in force");
  report.add("first_15_of_all_of_seed", first_15_of_all,
             "among the 15 most suspicious of these and of true ones that are not in force");
  report.add("last_rank_of_seed", last_rank, "rank of the last planted one among closures in force");
  double sum = 0, found = 0, found_of_all = 0;
  for (std::size_t i = 0; i < planted.size(); ++i)
    sum += planted[i], found += first_15[i], found_of_all += first_15_of_all[i];
  report.add("planted", sum, "in all drives");
  report.add("first_15", found, "of them among the 15 most suspicious closures in force of their drive");
  report.add("first_15_of_all", found_of_all,
             "of them among the 15 most suspicious of these and of true ones that are not in force");
}

}  // namespace

Run declare_suspicion(CLI::App& app) {
  const auto options = std::make_shared<SuspicionOptions>();
  app.add_option("--world", options->world,
                 "points: three simulated laps; fleet: three robots that drive one lap each; street: pictures of two "
                 "laps of a street; graph: a recorded pose graph "
                 "whose loops are true; or pictures of a ride, as in relmap-sim pictures --ride")
      ->check(CLI::IsMember(
          {"points", "fleet", "graph", "street", "lift", "lift-alike", "lift-ramp", "train", "escalator", "alike"}))
      ->capture_default_str();
  app.add_option("--graph", options->graph, "the g2o file of --world graph");
  app.add_option("--seeds", options->seeds, "number of drives")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--first-seed", options->first_seed, "seed of the first drive")->capture_default_str();
  app.add_option("--folder", options->folder,
                 "with points and fleet: keep the map of the one drive in this new data folder, and print on standard "
                 "error which closures were planted")
      ->check(CLI::NonexistentPath);
  app.add_flag("--list", options->list, "list every closure with its facts and doubts on standard error");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
