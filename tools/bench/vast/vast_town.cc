#include "tools/bench/vast/vast_town.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relmap::bench {

namespace {

constexpr double kOfThePlace = 0.75;        // of the features
constexpr double kResidual = 254 / 11.314;  // of each of 128 entries
constexpr double kWaysThere = 4;            // metres driven for each of street
constexpr double kMaxRideEvery = 5000;      // metres
constexpr double kMinRides = 3;             // of each robot

// Streets that run north, and as many that run east.
int streets_for(double metres, const sim::CityOptions& plan) {
  // n streets each way have 2 n (n - 1) blocks.
  const double blocks = metres / ((plan.min_block + plan.max_block) / 2);
  return std::max(2, static_cast<int>(std::lround((1 + std::sqrt(1 + 2 * blocks)) / 2)));
}

sim::CityWorldOptions world_options(const VastOptions& options) {
  sim::CityWorldOptions world;
  world.plan.seed = options.seed;
  const double metres = sim::CityDriveOptions().step * static_cast<double>(options.keyframes);
  world.plan.columns = world.plan.rows = streets_for(metres / kWaysThere, world.plan);
  world.draw = draw_words(place::Vocabulary::load(place::default_vocabulary_path()).or_throw());
  if (options.light) {
    world.tracks = 44;
    world.appearance = 45;
    world.tracked_per_metre = 20;
    world.described_per_metre = 4;
  }
  return world;
}

}  // namespace

sim::DrawDescriptor draw_words(std::shared_ptr<const place::Vocabulary> vocabulary) {
  std::vector<double> up_to;  // sums of the words' frequencies
  for (const float frequency : vocabulary->marginal()) up_to.push_back(frequency + (up_to.empty() ? 0 : up_to.back()));
  return [vocabulary = std::move(vocabulary), up_to = std::move(up_to)](std::uint64_t style, sim::Stream& random) {
    const auto sample = vocabulary->sample_place(style % vocabulary->sample_places());
    std::uint32_t word = 0;
    if (!sample.empty() && random.uniform() < kOfThePlace) {
      word = sample[std::min(sample.size() - 1,
                             static_cast<std::size_t>(random.uniform() * static_cast<double>(sample.size())))];
    } else {
      const auto at = std::upper_bound(up_to.begin(), up_to.end(), random.uniform() * up_to.back());
      word = static_cast<std::uint32_t>(std::min<std::ptrdiff_t>(at - up_to.begin(), std::ssize(up_to) - 1));
    }
    sim::Descriptor descriptor = vocabulary->centroid(word);
    for (std::uint8_t& entry : descriptor)
      entry = static_cast<std::uint8_t>(std::clamp(std::lround(entry + kResidual * random.normal()), 0L, 255L));
    return descriptor;
  };
}

VastTown::VastTown(const VastOptions& options) : world_(std::make_unique<sim::CityWorld>(world_options(options))) {
  for (std::uint32_t robot = 0; robot < options.robots; ++robot) {
    sim::CityDriveOptions drive;
    drive.seed = 1000 * options.seed + robot;
    drive.frames = static_cast<std::uint32_t>(options.keyframes / options.robots);
    drive.ride_every = std::min(kMaxRideEvery, drive.step * drive.frames / kMinRides);
    drives_.push_back(drive);
  }
}

SessionHeader VastTown::header(std::uint32_t robot) const {
  SessionHeader session;
  session.uuid.bytes = {'v', 'a', 's', 't'};
  for (int byte = 0; byte < 4; ++byte) session.uuid.bytes[12 + byte] = static_cast<std::uint8_t>(robot >> (8 * byte));
  session.robot = session.name = "robot " + std::to_string(robot + 1);
  session.camera = world_->options().camera;
  return session;
}

sim::CityRobot VastTown::robot(std::uint32_t robot, std::uint32_t first) const {
  return {*world_, drives_[robot], header(robot), first};
}

std::uint32_t VastTown::robot_of(const std::string& session) const {
  std::uint32_t robot = 0;
  while (robot < robots() && header(robot).name != session) ++robot;
  return robot;
}

}  // namespace relmap::bench
