// Both ends of the keyframe protocol over a channel that loses, doubles, reorders and damages messages, with a daemon
// that dies and forgets what was not on disk: every sequence is settled exactly once, and the robot's view of it is
// right. Then the same beside peers that lie.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <deque>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <variant>

#include "frontend/publishing/publisher_core.h"
#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "server/intake/intake.h"
#include "server/intake/testing/fake_sink.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;

struct Channel {
  double loss = 0, doubled = 0, damaged = 0;
  int delay_ms = 2, jitter_ms = 0;
};

class World {
 public:
  World(std::uint64_t seed, Channel channel) : random_(seed), channel_(channel), core_(session()) { start_daemon(); }

  // From now on the robot proves who it is, and each millisecond so many messages come of others, who do not tell the
  // truth: of a robot that proves to be another one, and of somebody who proves nothing.
  void let_others_lie(double messages_per_ms) {
    lies_per_ms_ = messages_per_ms;
    robot_ = {KeyframeSampler(1).keyframe().session.robot};
    start_daemon();
  }

  static SessionUuid session() {
    SessionUuid uuid;
    uuid.bytes.fill(9);
    return uuid;
  }

  // Keyframe `sequence`; `mutate` makes it bad.
  template <typename Mutate>
  void push(std::uint32_t sequence, Mutate&& mutate) {
    Keyframe k = KeyframeSampler(1).keyframe();
    k.session.uuid = session();
    k.sequence = sequence;
    k.time_us = 1'700'000'000'000'000 + sequence * 100'000LL;
    for (TrackMeasurement& t : k.tracks) t.track.sequence = std::min(t.track.sequence, sequence);
    k.picture.assign(4000, static_cast<std::uint8_t>(sequence));
    std::copy_n("\xff\xd8\xff", 3, k.picture.begin());
    mutate(k);
    const Bytes payload = encode_keyframe(k);
    const std::uint32_t crc = crc32c(payload);
    if (const auto gap = core_.skipped(sequence)) core_.give_up(*gap);
    core_.push(sequence, crc, static_cast<std::uint32_t>(payload.size()));
    spool_[sequence] = payload;
  }
  void push(std::uint32_t sequence) {
    push(sequence, [](Keyframe&) {});
  }

  // One millisecond.
  void step() {
    now_ += milliseconds(1);
    for (const auto& send : core_.poll(now_, 700)) transmit(send);
    for (double lies = lies_per_ms_; uniform() < lies; --lies) lie();
    deliver();
    EXPECT_LE(budget_.used(), budget_.limit());
    if (uniform() < 0.3) sink_.sync(static_cast<std::size_t>(uniform() * 5) + 1);
    for (const Acknowledgement& ack : intake_->poll(now_)) carry(ack);
  }
  bool run(int limit_ms) {
    for (int i = 0; i < limit_ms && !core_.all_settled(); ++i) step();
    return core_.all_settled();
  }
  void crash() {
    sink_.crash();
    start_daemon();
  }

  publishing::PublisherCore& core() { return core_; }
  intake::FakeSink& sink() { return sink_; }
  intake::IngestStats stats() const { return intake_->stats(now_); }

  // Of the parts that were sent, those that had been sent before.
  double resent_share() const {
    std::size_t once = 0;
    for (const auto& [sequence, payload] : spool_) once += count_parts(payload.size(), 700);
    return 1 - static_cast<double>(once) / static_cast<double>(parts_sent_);
  }

  // What became of each sequence, by the journal.
  std::map<std::uint32_t, Reason> outcomes() {
    std::map<std::uint32_t, Reason> all;
    for (const storage::JournalRecord& record : sink_.journal()) {
      if (const auto* k = std::get_if<storage::KeyframeRecord>(&record)) {
        const Keyframe keyframe = *decode_keyframe(k->payload);
        if (keyframe.session.uuid != session()) {
          EXPECT_NE(keyframe.session.robot, robot_.robot) << "somebody has begun a session in the robot's name";
          continue;
        }
        const std::uint32_t sequence = keyframe.sequence;
        EXPECT_TRUE(all.emplace(sequence, Reason::OK).second) << "doubled: " << sequence;
        EXPECT_EQ(k->payload, spool_[sequence]);
      } else if (const auto* r = std::get_if<storage::RefusalRecord>(&record); r && r->session == own()) {
        EXPECT_TRUE(all.emplace(r->sequence, r->reason).second) << "doubled: " << r->sequence;
      } else if (const auto* g = std::get_if<storage::GapRecord>(&record); g && g->session == own()) {
        for (std::uint32_t s = g->from; s <= g->to; ++s)
          EXPECT_TRUE(all.emplace(s, g->reason).second) << "doubled: " << s;
      }
    }
    return all;
  }

 private:
  using Message = std::variant<KeyframePart, Gap, Acknowledgement>;

  // The session's number in the map.
  SessionNumber own() const {
    for (const storage::Session& known : sink_.view()->sessions())
      if (known.header.uuid == session()) return known.number;
    return 0;
  }

  // A message that its sender may send, and that is not true, of the robot's session or of any other.
  void lie() {
    const intake::Sender sender = uniform() < 0.5 ? intake::Sender{"mallory"} : intake::Sender{{}, true};
    SessionUuid uuid = session();
    if (uniform() < 0.6) {
      uuid.bytes.fill(3);
      uuid.bytes[0] = static_cast<std::uint8_t>(random_());
      uuid.bytes[1] = static_cast<std::uint8_t>(random_());
    }
    const auto sequence = static_cast<std::uint32_t>(uniform() < 0.9 ? random_() % 250 : random_());
    switch (random_() % 5) {
      case 0:
        (void)intake_->take_gap({uuid, sequence, sequence + static_cast<std::uint32_t>(random_() % 300),
                                 uniform() < 0.5 ? Reason::DROPPED_BY_ROBOT : Reason::MAP_RESTORED},
                                now_, sender);
        break;
      case 1:
        (void)intake_->take_end({uuid, uniform() < 0.5 ? sequence : core_.next_sequence()}, now_, sender);
        break;
      case 2: {  // a part of the robot's own keyframe, spoilt
        if (spool_.empty()) return;
        const Bytes& payload = spool_.rbegin()->second;
        auto part = cut_part(uuid, spool_.rbegin()->first, payload, crc32c(payload), 700, 0);
        part.data[random_() % part.data.size()] ^= 1;
        part.part_crc = part_checksum(part);
        intake_->take_part(part, now_, sender);
        break;
      }
      default: {  // a whole keyframe, of its own name or of the robot's
        Keyframe k = KeyframeSampler(random_() % 50).keyframe();
        k.session.uuid = uuid;
        k.session.robot = uniform() < 0.5 ? "mallory" : robot_.robot;
        k.sequence = sequence;
        k.time_us = static_cast<std::int64_t>(random_() % 3'000'000'000'000'000);
        const Bytes payload = encode_keyframe(k);
        const std::uint32_t count = count_parts(payload.size(), 60000);
        for (std::uint32_t i = 0; i < count; ++i)
          intake_->take_part(cut_part(uuid, sequence, payload, crc32c(payload), 60000, i), now_, sender);
      }
    }
  }

  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  void start_daemon() {
    BootId boot{};
    boot[0] = ++boots_;
    intake::IntakeOptions options;
    if (lies_per_ms_ > 0) options.proving = {robot_.robot};
    intake_ = std::make_unique<intake::Intake>(sink_, budget_, boot, options, [] {});
    if (lies_per_ms_ > 0) (void)intake_->claim(session(), now_, robot_);
    std::erase_if(under_way_, [](const auto& m) { return std::holds_alternative<Acknowledgement>(m.second); });
  }

  void transmit(const publishing::PublisherCore::Send& send) {
    if (send.gap) return carry(Gap{session(), send.sequence, send.to, send.reason});
    const Bytes& payload = spool_.at(send.sequence);
    const std::uint32_t crc = crc32c(payload);
    const std::uint32_t count = count_parts(payload.size(), 700);
    for (std::uint32_t i = 0; i < count; ++i)
      if (send.parts.empty() || std::count(send.parts.begin(), send.parts.end(), i)) {
        carry(cut_part(session(), send.sequence, payload, crc, 700, i));
        ++parts_sent_;
      }
  }

  void carry(Message message) {
    for (int copies = uniform() < channel_.doubled ? 2 : 1; copies > 0; --copies) {
      if (uniform() < channel_.loss) continue;
      Message copy = message;
      if (auto* part = std::get_if<KeyframePart>(&copy); part && uniform() < channel_.damaged) {
        switch (static_cast<int>(uniform() * 4)) {
          case 0:
            part->data[static_cast<std::size_t>(uniform() * static_cast<double>(part->data.size()))] ^= 0x40;
            break;
          case 1:
            part->data.pop_back();
            break;
          case 2:
            ++part->sequence;
            break;
          default:
            part->payload_crc ^= 1;
        }
      }
      under_way_.emplace(now_ + milliseconds(channel_.delay_ms + static_cast<int>(uniform() * channel_.jitter_ms)),
                         std::move(copy));
    }
  }

  void deliver() {
    while (!under_way_.empty() && under_way_.begin()->first <= now_) {
      const Message message = std::move(under_way_.begin()->second);
      under_way_.erase(under_way_.begin());
      if (const auto* part = std::get_if<KeyframePart>(&message)) intake_->take_part(*part, now_, robot_);
      if (const auto* gap = std::get_if<Gap>(&message)) (void)intake_->take_gap(*gap, now_, robot_);
      if (const auto* ack = std::get_if<Acknowledgement>(&message)) core_.acknowledge(*ack, now_);
    }
  }

  std::mt19937_64 random_;
  Channel channel_;
  intake::SteadyTime now_{std::chrono::hours(1)};
  intake::FakeSink sink_;
  storage::Budget budget_{std::size_t{256} << 20};
  publishing::PublisherCore core_;
  std::unique_ptr<intake::Intake> intake_;
  std::uint8_t boots_ = 0;
  intake::Sender robot_;
  double lies_per_ms_ = 0;
  std::size_t parts_sent_ = 0;
  std::map<std::uint32_t, Bytes> spool_;
  std::multimap<intake::SteadyTime, Message> under_way_;
};

TEST(IngestSimulation, PerfectChannelSettlesEverythingAtTheFirstSending) {
  World world(1, {});
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
    World world(seed, {0.05, 0.05, 0.02, 1, 15});
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
    World world(seed, {0.05, 0.01, 0, 1, 15});
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
    World world(seed, {0.05, 0.02, 0.01, 1, 10});
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
  World world(3, {});
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
  World world(4, {});
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
  World world(5, {0.05, 0.05, 0.01, 1, 10});
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
  World world(6, {0.1, 0.05, 0, 1, 10});
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
    World world(seed, {0.05, 0.05, 0.01, 1, 10});
    world.let_others_lie(seed % 2 == 0 ? 0.5 : 3);
    for (int i = 0; i < 200; ++i) world.step();  // they are there before the robot
    std::mt19937_64 random(seed);
    for (std::uint32_t s = 0; s < keyframes; ++s) {
      world.push(s);
      if (s % 50 == 49) {
        for (int i = static_cast<int>(random() % 200); i > 0; --i) world.step();
        if (seed % 3 == 0) world.crash();
      }
    }
    ASSERT_TRUE(world.run(120'000)) << "seed " << seed << ": " << world.core().unsettled() << " unsettled";
    const auto outcomes = world.outcomes();
    EXPECT_EQ(outcomes.size(), keyframes) << "seed " << seed;
    for (const auto& [sequence, reason] : outcomes) EXPECT_EQ(reason, Reason::OK) << sequence << ", seed " << seed;
    EXPECT_EQ(world.core().counts().gaps, 0u);
    EXPECT_TRUE(world.core().counts().refused.empty());
    EXPECT_GT(world.stats().messages_refused[intake::index_of(Reason::NOT_ALLOWED)], 0u);
    EXPECT_EQ(world.sink().faults, std::vector<std::string>{});
  }
}
TEST(IngestSimulation, AdversariesNeitherForgeNorStarve) { settles_beside_liars(12, 150); }
TEST(LongIngestSimulation, AdversariesNeitherForgeNorStarve) { settles_beside_liars(300, 400); }

TEST(IngestSimulation, SlowSinkIsNotOverrun) {
  World world(7, {});
  world.sink().capacity = 2;
  for (std::uint32_t s = 0; s < 150; ++s) world.push(s);
  ASSERT_TRUE(world.run(60000));
  EXPECT_EQ(world.outcomes().size(), 150u);
  EXPECT_LE(world.core().counts().resent, 15u);  // pacing, not resending, does it
  EXPECT_EQ(world.sink().faults, std::vector<std::string>{});
}

}  // namespace
}  // namespace relmap::testing
