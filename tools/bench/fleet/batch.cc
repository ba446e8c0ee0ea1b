#include "tools/bench/fleet/batch.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "frontend/publishing/grpc/grpc_transport.h"
#include "frontend/publishing/publisher.h"
#include "tests/support/running_daemon.h"
#include "tools/bench/fleet/keyframes.h"
#include "tools/bench/stopwatch.h"

namespace relmap::bench {

namespace {

std::vector<Keyframe> recording(const FleetLap& lap, const FleetRobot& robot, std::uint32_t size) {
  std::vector<Keyframe> keyframes;
  SE3 T_odom_previous;
  for (std::uint32_t i = 0; i < size; ++i) {
    keyframes.push_back(lap.keyframe(robot, i, T_odom_previous));
    T_odom_previous = keyframes.back().T_odom_frame;
  }
  return keyframes;
}

}  // namespace

void publish(const std::string& server, const SessionHeader& session, const std::vector<Keyframe>& keyframes) {
  publishing::PublisherOptions options;
  options.in_memory = true;
  options.spool_bytes = std::size_t{16} << 20;
  auto publisher =
      publishing::Publisher::start(options, session, publishing::GrpcTransport::open(server, session.robot).or_throw())
          .or_throw();
  for (const Keyframe& keyframe : keyframes)
    if (Status pushed = publisher->push(keyframe); !pushed.ok()) throw StatusError(pushed);
  if (!publisher->finish(Clock::now() + std::chrono::minutes(10)).all_settled())
    throw std::runtime_error("not all of a session was settled in ten minutes");
}

BatchSpeed run_batch(const std::string& folder, const BatchLoad& load) {
  std::filesystem::create_directories(folder);
  FleetLap::make(folder + "/light.bin", kLightKeyframeBytes, load.seed);
  const FleetLap lap(folder + "/light.bin");
  std::vector<FleetRobot> robots;
  std::vector<std::vector<Keyframe>> recordings;
  for (std::uint32_t i = 0; i < load.recordings; ++i) {
    robots.push_back({i, load.seed, start_of(i, load.recordings), 1'700'000'000'000'000, 200'000});
    recordings.push_back(recording(lap, robots.back(), load.keyframes / load.recordings));
  }

  testing::DaemonOptions options{
      .data = folder + "/map", .lcm = {}, .memory_budget_mb = load.memory_budget_mb, .more = {}};
  if (!load.closures) options.more.push_back("--no-closures");
  if (!load.relax) {
    std::ofstream(folder + "/config.yaml") << "rba: {window: 0}\n";
    options.more.insert(options.more.end(), {"--config", folder + "/config.yaml"});
  }
  testing::RunningDaemon daemon(options);
  const auto client = daemon.client();

  BatchSpeed speed;
  const auto begin = Clock::now();
  const double all = static_cast<double>(load.keyframes / load.recordings * load.recordings);
  {
    std::vector<std::jthread> publishing;
    std::vector<std::exception_ptr> failures(load.recordings);
    for (std::uint32_t i = 0; i < load.recordings; ++i)
      publishing.emplace_back([&, i] {
        try {
          publish(options.data, FleetLap::header(robots[i]), recordings[i]);
        } catch (...) {
          failures[i] = std::current_exception();
        }
      });
    publishing.clear();
    for (const std::exception_ptr& failure : failures)
      if (failure) std::rethrow_exception(failure);
  }
  speed.durable_per_s = all / seconds_since(begin);
  for (;; std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
    const client::DaemonStatus status = client->status().or_throw();
    if (status.applied_sequence >= status.durable_sequence && status.lookup_lag == 0) break;
    if (seconds_since(begin) > 1800) throw std::runtime_error("a batch was not done in half an hour");
  }
  speed.done_per_s = all / seconds_since(begin);
  if (client->status()->frames != static_cast<std::uint64_t>(all)) throw std::runtime_error("a batch lost frames");
  if (daemon.stop() != 0) throw std::runtime_error("relmapd did not stop as it should: " + daemon.log());
  return speed;
}

}  // namespace relmap::bench
