// Both ends of the keyframe protocol over a channel that loses, doubles, reorders and damages messages, with a daemon
// that dies and forgets what was not on disk: every sequence is settled exactly once, and the robot's view of it is
// right. Then the same beside peers that lie.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "tests/support/ingest_world.h"

namespace relmap::testing {
namespace {

// A world in which the robot proves who it is, and others do not tell the truth: a robot that proves to be another one,
// and somebody who proves nothing.
class LyingWorld final : public IngestWorld {
 public:
  // `lies_per_ms`: messages of others. `claimed`: the robot announces its session to each daemon before they lie;
  // otherwise its first message may come behind what anyone sends of its session.
  LyingWorld(std::uint64_t seed, Channel channel, double lies_per_ms, bool claimed)
      : IngestWorld(seed, channel), lies_per_ms_(lies_per_ms), claimed_(claimed) {
    restart();
  }
  void restart() {
    crash();
    if (claimed_) (void)intake().claim(session(), now(), sender());
  }
  std::uint64_t repeats() const { return repeats_; }

 protected:
  intake::IntakeOptions options() const override {
    intake::IntakeOptions options;
    options.proving = {kRobot, "mallory"};  // else anyone who has heard of a session could begin it as mallory's
    return options;
  }
  intake::Sender sender() const override { return {kRobot}; }
  void send(Message message) override {
    const bool of_daemon = std::holds_alternative<Acknowledgement>(message);
    if (of_daemon && !announced()) return;  // it is for those who have sent something
    if (!of_daemon) {
      if (sent_.size() < kKept)
        sent_.push_back(message);
      else
        sent_[random_() % kKept] = message;
      if (uniform() < kHeldBack)
        carry_late(message, std::chrono::milliseconds(static_cast<int>(uniform() * kHeldBackMs)));
    }
    carry(std::move(message));
  }
  void act() override {
    for (double lies = lies_per_ms_; uniform() < lies; --lies) lie();
  }

 private:
  static constexpr std::size_t kKept = 1000;
  static constexpr double kHeldBack = 0.01;  // share of the robot's messages that come again, up to so much later
  static constexpr double kHeldBackMs = 20'000;
  static const inline std::string kRobot = KeyframeSampler(1).keyframe().session.robot;

  // Whether the daemon has heard of the session from its robot.
  bool announced() const { return claimed_ || robot_heard() || has_begun(); }

  // A message that its sender may send, and that is not true, of the robot's session or of any other.
  void lie() {
    SessionUuid uuid = session();
    if (uniform() < 0.6) {
      uuid.bytes.fill(3);
      uuid.bytes[0] = static_cast<std::uint8_t>(random_());
      uuid.bytes[1] = static_cast<std::uint8_t>(random_());
    }
    intake::Sender liar = uniform() < 0.5 ? intake::Sender{"mallory"} : intake::Sender{{}, true};
    // What has neither begun nor been announced is of the robot that first proves to send it.
    const intake::Sender anyone{{}, true};
    if (uuid == session() && !announced()) liar = anyone;
    const auto sequence = static_cast<std::uint32_t>(uniform() < 0.9 ? random_() % 250 : random_());
    switch (random_() % 6) {
      case 0:
        (void)intake().take_gap({uuid, sequence, sequence + static_cast<std::uint32_t>(random_() % 300),
                                 uniform() < 0.5 ? Reason::DROPPED_BY_ROBOT : Reason::MAP_RESTORED},
                                now(), liar);
        break;
      case 1:
        (void)intake().take_end({uuid, uniform() < 0.5 ? sequence : core().next_sequence()}, now(), liar);
        break;
      case 2: {  // a part of the robot's own keyframe, spoilt
        if (spool().empty()) return;
        const auto& [newest, payload] = *spool().rbegin();
        auto part = cut_part(uuid, newest, payload, crc32c(payload), 700, 0);
        part.data[random_() % part.data.size()] ^= 1;
        part.part_crc = part_checksum(part);
        intake().take_part(part, now(), liar);
        break;
      }
      case 3:  // what the robot has sent, as it sent it
        if (sent_.empty()) return;
        take_from_robot(sent_[random_() % sent_.size()], announced() ? liar : anyone);
        ++repeats_;
        break;
      default: {  // a whole keyframe, of its own name or of the robot's
        Keyframe k = KeyframeSampler(random_() % 50).keyframe();
        k.session.uuid = uuid;
        k.session.robot = uniform() < 0.5 ? "mallory" : kRobot;
        k.sequence = sequence;
        k.time_us = static_cast<std::int64_t>(random_() % 3'000'000'000'000'000);
        const Bytes payload = encode_keyframe(k);
        const std::uint32_t count = count_parts(payload.size(), 60000);
        for (std::uint32_t i = 0; i < count; ++i)
          intake().take_part(cut_part(uuid, sequence, payload, crc32c(payload), 60000, i), now(), liar);
      }
    }
  }

  const double lies_per_ms_;
  const bool claimed_;
  std::vector<Message> sent_;  // by the robot
  std::uint64_t repeats_ = 0;
};

TEST(IngestSimulation, PerfectChannelSettlesEverythingAtTheFirstSending) {
  IngestWorld world(1, {});
  for (std::uint32_t s = 0; s < 200; ++s) world.push(s);
  ASSERT_TRUE(world.run(5000));
  EXPECT_EQ(world.core().counts().sent, 200u);
  EXPECT_EQ(world.core().counts().resent, 0u);
  EXPECT_EQ(world.core().counts().parts_resent, 0u);
  EXPECT_EQ(world.core().counts().settled, 200u);
  EXPECT_EQ(world.stats().keyframes_durable, 200u);
  EXPECT_TRUE(world.sink().faults.empty());
}

TEST(IngestSimulation, LossDoublingReorderingAndDamageLoseAndDoubleNothing) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    IngestWorld world(seed, {0.05, 0.05, 0.02, 1, 15});
    for (std::uint32_t s = 0; s < 200; ++s) world.push(s);
    ASSERT_TRUE(world.run(60000)) << "seed " << seed << ": " << world.core().unsettled() << " unsettled";
    const auto outcomes = world.outcomes();
    EXPECT_EQ(outcomes.size(), 200u);
    for (const auto& [sequence, reason] : outcomes) EXPECT_EQ(reason, Reason::OK) << sequence;
    EXPECT_GT(world.stats().parts_refused[intake::index_of(Reason::CORRUPT)], 0u);
    EXPECT_TRUE(world.core().counts().refused.empty());
    EXPECT_EQ(world.sink().faults, std::vector<std::string>{});
  }
}

// docs/figures.md, Fleets: 5.0 % of the bytes, over a network that loses 5 %. Time is simulated here, so that no
// acknowledgement is late for want of a processor.
TEST(IngestSimulation, LittleMoreThanWhatIsLostIsSentAgain) {
  double share = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    IngestWorld world(seed, {0.05, 0.01, 0, 1, 15});
    for (std::uint32_t s = 0; s < 200; ++s) world.push(s);
    ASSERT_TRUE(world.run(60000)) << "seed " << seed;
    share += world.resent_share() / 5;
  }
  std::printf("sent again: %.4f\n", share);
  EXPECT_LE(share, 0.075);
  EXPECT_GE(share, 0.03) << "the network was not bad";
}

TEST(IngestSimulation, DaemonThatDiesAgainAndAgainGetsWhatItForgot) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    IngestWorld world(seed, {0.05, 0.02, 0.01, 1, 10});
    for (std::uint32_t s = 0; s < 200; ++s) world.push(s);
    std::mt19937_64 random(seed);
    for (int crashes = 0; crashes < 10; ++crashes) {
      for (int i = static_cast<int>(random() % 200); i > 0; --i) world.step();
      world.crash();
    }
    ASSERT_TRUE(world.run(60000)) << "seed " << seed;
    EXPECT_EQ(world.outcomes().size(), 200u);
    EXPECT_GT(world.core().counts().restarts_seen, 0u);
    EXPECT_EQ(world.sink().faults, std::vector<std::string>{});
  }
}

TEST(IngestSimulation, DiskThatLostAcknowledgedRecordsGetsThemAgain) {
  IngestWorld world(3, {});
  for (std::uint32_t s = 0; s < 100; ++s) world.push(s);
  ASSERT_TRUE(world.run(10000));
  world.sink().forget_durable(20);
  world.crash();
  world.push(100);
  ASSERT_TRUE(world.run(10000));
  EXPECT_EQ(world.outcomes().size(), 101u);
  EXPECT_EQ(world.core().counts().settled, 101u);
  EXPECT_EQ(world.sink().faults, std::vector<std::string>{});
}

TEST(IngestSimulation, NewMapIsToldWhatTheSpoolNoLongerHas) {
  IngestWorld world(4, {});
  for (std::uint32_t s = 0; s < 200; ++s) world.push(s);
  ASSERT_TRUE(world.run(10000));
  world.sink().forget_durable(200);
  world.crash();
  world.push(200);
  ASSERT_TRUE(world.run(10000));
  const auto outcomes = world.outcomes();
  EXPECT_EQ(outcomes.size(), 201u);
  EXPECT_EQ(outcomes.at(0), Reason::DROPPED_BY_ROBOT);
  EXPECT_EQ(outcomes.at(199), Reason::OK);
}

TEST(IngestSimulation, BadKeyframesAreRefusedByNameOnLossyChannelsToo) {
  IngestWorld world(5, {0.05, 0.05, 0.01, 1, 10});
  for (std::uint32_t s = 0; s < 100; ++s) {
    world.push(s, [s](Keyframe& k) {
      if (s == 10) k.T_odom_frame.t.x() = std::numeric_limits<double>::quiet_NaN();
      if (s == 20) k.time_us -= 1'000'000;
      if (s == 30) k.session.camera.f = 0.001;
      if (s == 40) k.session.camera.f = 500;
      if (s == 50) k.tracks[0].track.sequence = 60;
    });
  }
  ASSERT_TRUE(world.run(60000));
  const auto outcomes = world.outcomes();
  EXPECT_EQ(outcomes.at(10), Reason::NOT_FINITE);
  EXPECT_EQ(outcomes.at(20), Reason::TIME_BACKWARDS);
  EXPECT_EQ(outcomes.at(30), Reason::IMPLAUSIBLE_CALIBRATION);
  EXPECT_EQ(outcomes.at(40), Reason::CALIBRATION_CHANGED);
  EXPECT_EQ(outcomes.at(50), Reason::BAD_TRACK);
  const auto& refused = world.core().counts().refused;
  EXPECT_EQ(refused.size(), 5u);
  for (const auto& [reason, count] : refused) EXPECT_EQ(count, 1u) << reason_name(reason);
  EXPECT_EQ(std::count_if(outcomes.begin(), outcomes.end(), [](const auto& o) { return o.second == Reason::OK; }), 95);
}

TEST(IngestSimulation, GapsAndSkippedSequencesAreSettled) {
  IngestWorld world(6, {0.1, 0.05, 0, 1, 10});
  for (std::uint32_t s = 5; s < 300; s += s % 7 == 0 ? 40 : 1) world.push(s);
  const auto dropped = world.core().oldest_to_drop();
  ASSERT_TRUE(dropped);
  EXPECT_EQ(dropped->from, 5u);
  world.core().give_up(*dropped);
  ASSERT_TRUE(world.run(60000));
  const auto outcomes = world.outcomes();
  EXPECT_EQ(outcomes.size(), world.core().next_sequence());
  EXPECT_EQ(outcomes.at(0), Reason::CAPTURE_FAILED);
  EXPECT_EQ(outcomes.at(5), Reason::DROPPED_BY_ROBOT);
  EXPECT_EQ(outcomes.at(6), Reason::OK);
  EXPECT_EQ(world.sink().faults, std::vector<std::string>{});
}

// Whatever others send, of its session or of a thousand of their own, the robot's keyframes are settled, as it sent
// them.
void settles_beside_liars(std::uint64_t seeds, std::uint32_t keyframes) {
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    LyingWorld world(seed, {0.05, 0.05, 0.01, 1, 10}, seed % 2 == 0 ? 0.5 : 3, seed % 4 < 2);
    for (int i = 0; i < 200; ++i) world.step();  // they are there before the robot
    std::mt19937_64 random(seed);
    for (std::uint32_t s = 0; s < keyframes; ++s) {
      world.push(s);
      if (s % 50 == 49) {
        for (int i = static_cast<int>(random() % 200); i > 0; --i) world.step();
        if (seed % 3 == 0) world.restart();
      }
    }
    ASSERT_TRUE(world.run(120'000)) << "seed " << seed << ": " << world.core().unsettled() << " unsettled";
    const auto outcomes = world.outcomes();
    EXPECT_EQ(outcomes.size(), keyframes) << "seed " << seed;
    for (const auto& [sequence, reason] : outcomes) EXPECT_EQ(reason, Reason::OK) << sequence << ", seed " << seed;
    EXPECT_EQ(world.core().counts().gaps, 0u);
    for (const auto& [reason, count] : world.core().counts().refused)
      ADD_FAILURE() << "the robot takes " << count << " for refused: " << reason_name(reason) << ", seed " << seed;
    EXPECT_GT(world.stats().messages_refused[intake::index_of(Reason::NOT_ALLOWED)], 0u);
    EXPECT_GT(world.repeats(), 10u);
    EXPECT_EQ(world.sink().faults, std::vector<std::string>{});
  }
}
TEST(IngestSimulation, AdversariesNeitherForgeNorStarve) { settles_beside_liars(12, 150); }
TEST(LongIngestSimulation, AdversariesNeitherForgeNorStarve) { settles_beside_liars(300, 400); }

TEST(IngestSimulation, SlowSinkIsNotOverrun) {
  IngestWorld world(7, {});
  world.sink().capacity = 2;
  for (std::uint32_t s = 0; s < 150; ++s) world.push(s);
  ASSERT_TRUE(world.run(60000));
  EXPECT_EQ(world.outcomes().size(), 150u);
  EXPECT_LE(world.core().counts().resent, 15u);  // pacing, not resending, does it
  EXPECT_EQ(world.sink().faults, std::vector<std::string>{});
}

}  // namespace
}  // namespace relmap::testing
