// For tests: a small map behind the handlers, in the memory engine. Session 1 drove a circuit about 1.25 times; session
// 2 is another place without edges to the first.
#pragma once

#include <gtest/gtest.h>

#include "proto/base/crc32c.h"
#include "server/map/mapper.h"
#include "server/map/testing/one_eye.h"
#include "server/place/testing/random_vocabulary.h"
#include "server/rpc/core.h"
#include "storage/engine/memory_engine.h"
#include "tools/sim/points_world.h"

namespace relmap::rpc {

class ServedMap {
 public:
  static constexpr std::uint32_t kLap = 40, kFrames = 50, kElsewhere = 6;
  static constexpr std::uint32_t kWords = 1000;
  static constexpr FrameId kFirst{1, 0}, kLast{1, kFrames - 1}, kUnconnected{2, 3};

  explicit ServedMap(RpcLimits limits = {}, const map::MapperOptions& options = {})
      : circuit(circuit_options()), elsewhere(elsewhere_options()) {
    start(limits, options);
    take_in(circuit);
    take_in(elsewhere);
    settle();
  }

  // Ends the service and serves the same map again.
  void restart(const map::MapperOptions& options = {}) {
    core.reset();
    mapper.reset();
    start({}, options);
  }

  void take_in(const sim::PointsWorld& world) {
    const SessionNumber session = mapper->begin_session(world.keyframe(0).session).or_throw();
    for (std::uint32_t i = 0; i < world.size(); ++i) submit(session, world.keyframe(i));
  }
  void submit(SessionNumber session, const Keyframe& keyframe) {
    const Bytes payload = encode_keyframe(keyframe);
    const storage::KeyframeRecord record{session, crc32c(payload), payload};
    auto taken = mapper->submit_and_wait(record);
    if (taken.reason() == Reason::BUDGET_EXCEEDED) {  // with sanitizers the worker falls behind
      settle();
      taken = mapper->submit_and_wait(record);
    }
    EXPECT_TRUE(taken.ok()) << taken.status().to_string();
  }

  // Waits until the mapper has nothing to do; it comes to the end of the deadline only if something hangs.
  void settle() const {
    const Status idle = mapper->wait_idle(std::chrono::steady_clock::now() + std::chrono::minutes(10));
    EXPECT_TRUE(idle.ok()) << idle.to_string();
  }

  // Adds frames 0 .. count - 1 of the circuit as a mono session.
  SessionNumber take_in_with_one_eye(std::uint32_t count) {
    const SessionNumber session = mapper->begin_session(map::with_one_eye(circuit.keyframe(0)).session).or_throw();
    for (std::uint32_t i = 0; i < count; ++i) submit(session, map::with_one_eye(circuit.keyframe(i)));
    settle();
    return session;
  }

  static sim::PointsWorldOptions circuit_options() {
    sim::PointsWorldOptions options;
    options.frames = kFrames;
    options.frames_per_lap = kLap;
    options.speed = 0.4;  // so slow that a lap takes longer than the recent past, which place recognition masks
    options.births = 20;
    options.appearance = 140;
    return options;
  }
  static sim::PointsWorldOptions elsewhere_options() {
    sim::PointsWorldOptions options = circuit_options();
    options.world_seed = 99;
    options.frames = kElsewhere;
    options.uuid.bytes[15] = 2;
    options.session = "elsewhere";
    return options;
  }

  const sim::PointsWorld circuit, elsewhere;
  const std::shared_ptr<storage::Engine> engine = storage::make_memory_engine();
  std::unique_ptr<map::Mapper> mapper;
  std::unique_ptr<Core> core;

 private:
  void start(RpcLimits limits, const map::MapperOptions& options) {
    auto opened = map::Mapper::open(engine, std::make_shared<storage::Budget>(std::size_t{256} << 20),
                                    place::random_vocabulary(kWords, 60, 1), options);
    mapper = std::move(opened).or_throw();
    core = std::make_unique<Core>(*mapper, DaemonFacts{"test", "b007b007b007", "/data", "", false, 4711, 0}, limits);
  }
};

}  // namespace relmap::rpc
