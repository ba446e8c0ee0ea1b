// The keyframe protocol in simulated time, sealed as over LCM, beside an adversary that hears everything and forges,
// repeats and delays whatever robots and daemon may say: a robot's keyframes are settled, as it sent them, and it
// believes nothing that the daemon has not said.
#include <gtest/gtest.h>

#include <chrono>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>

#include "proto/access/access_list.h"
#include "proto/base/hex.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"
#include "server/ingest/sealed_robots.h"
#include "tests/support/adversary.h"
#include "tests/support/ingest_world.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;

class SealedWorld final : public IngestWorld {
 public:
  // `insider`: the adversary is a robot of the fleet, too, and comes when the robot's session has begun: a session that
  // nobody has announced is of the first robot that does. Otherwise it is there before the robot.
  SealedWorld(std::uint64_t seed, Channel channel, double forgeries_per_ms, bool insider)
      : IngestWorld(seed, channel),
        forgeries_per_ms_(forgeries_per_ms),
        insider_(insider),
        robot_(issue(1, kRobot), seed),
        adversary_({session()}, seed) {
    const access::RobotKey mallory = issue(2, "mallory");
    if (insider) adversary_.use(mallory);
    restart();
  }

  void restart() {
    if (door_) not_allowed_before_ = not_allowed();
    crash();
    door_.emplace(boot(), secret_, now());
    door_->use(list_);
  }

  std::size_t forged() const { return forged_; }
  std::uint64_t refused(Reason reason) const { return refused_[intake::index_of(reason)]; }
  std::uint64_t refused() const { return std::accumulate(refused_.begin(), refused_.end(), std::uint64_t{0}); }
  // What the intakes have not taken, since it was another's.
  std::uint64_t not_allowed() const {
    const auto at = intake::index_of(Reason::NOT_ALLOWED);
    return not_allowed_before_ + stats().messages_refused[at] + stats().parts_refused[at];
  }
  std::uint64_t unbelieved() const { return unbelieved_; }  // by the robot
  std::size_t news() const { return news_; }                // that the robot believed

 protected:
  intake::IntakeOptions options() const override {
    intake::IntakeOptions options;
    options.max_new_sessions_per_min = 60;
    return options;
  }
  intake::Sender sender() const override { return {kRobot}; }

  void send(Message message) override {
    if (const auto* ack = std::get_if<Acknowledgement>(&message))
      return tell(ack->session, kAckChannel, encode_lcm(*ack));
    if (!robot_.ready(now())) return;
    const auto [channel, bytes] = std::visit(
        [](const auto& one) -> std::pair<const char*, Bytes> {
          using Kind = std::decay_t<decltype(one)>;
          constexpr const char* kChannel = std::is_same_v<Kind, KeyframePart> ? kKeyframeChannel
                                           : std::is_same_v<Kind, Gap>        ? kGapChannel
                                                                              : kEndChannel;
          return {kChannel, encode_lcm(one)};
        },
        message);
    Bytes sealed = bytes;
    robot_.seal(channel, sealed);
    post(channel, std::move(sealed));
  }
  void tell(const PoseNews& news) override { tell(news.session, kPoseChannel, encode_lcm(news)); }

  void take(const Datagram& datagram) override {
    const std::string_view channel = datagram.channel;
    if (channel == kHelloChannel) return take_hello(datagram);
    if (channel == kKeyframeChannel) return take_sealed(datagram, decode_lcm_part);
    if (channel == kGapChannel) return take_sealed(datagram, decode_lcm_gap);
    if (channel == kEndChannel) return take_sealed(datagram, decode_lcm_end);
    hear(datagram);
  }

  void act() override {
    if (now() >= map_due_) {
      map_due_ = now() + milliseconds(100);
      post(kMapChannel, encode_lcm(identity()));
    }
    if (robot_.wants_hello(now()) && now() >= hello_due_) {
      hello_due_ = now() + milliseconds(500);
      Bytes hello = encode_lcm(Hello{session()});
      robot_.seal_hello(hello);
      post(kHelloChannel, std::move(hello));
    }
    if (insider_ && !has_begun()) return;
    for (double more = forgeries_per_ms_; uniform() < more; --more) {
      Adversary::Datagram made = adversary_.forge(now());
      carry_late(Datagram{made.channel, std::move(made.bytes)}, milliseconds(random_() % 5));
      ++forged_;
    }
  }

 private:
  static const inline std::string kRobot = KeyframeSampler(1).keyframe().session.robot;
  static constexpr std::int64_t kUtc = 1'700'000'000;
  static constexpr double kHeldBack = 0.02;  // share of datagrams that the adversary holds back, for up to so long
  static constexpr double kHeldBackMs = 20'000;

  access::RobotKey issue(std::uint8_t number, const std::string& robot) {
    access::SealKey drawn{};
    drawn.fill(number);
    list_.add({access::Grant::Kind::kKey, hex(drawn), {access::Role::kRobot, robot}, INT64_MAX, false});
    return access::robot_key(secret_, drawn);
  }
  DaemonIdentity identity() const {
    DaemonIdentity identity{boot(), {}};
    identity.map.uuid.bytes.fill(7);
    identity.map.epoch = 1;
    return identity;
  }

  // Everyone hears it.
  void post(const char* channel, Bytes bytes) {
    adversary_.hear(channel, bytes, now());
    Datagram datagram{channel, std::move(bytes)};
    if (uniform() < kHeldBack)
      carry_late(std::move(datagram), milliseconds(static_cast<int>(uniform() * kHeldBackMs)));
    else
      carry(std::move(datagram));
  }
  void tell(const SessionUuid& session, const char* channel, const Bytes& message) {
    for (Bytes& sealed : door_->seal(session, intake().robot_of(session), channel, message, now()))
      post(channel, std::move(sealed));
  }

  template <typename Message>
  void take_sealed(const Datagram& datagram, Result<Message> (*decode)(ByteSpan)) {
    const auto opened = door_->open(datagram.channel, datagram.bytes, now(), kUtc);
    const Result<Message> message = opened.ok() ? decode(opened->message) : opened.status();
    if (!message.ok()) {
      ++refused_[intake::index_of(message.reason())];
      return;
    }
    door_->sends(*opened, message->session);
    take_from_robot(*message, {opened->robot});
  }
  void take_hello(const Datagram& datagram) {
    const auto opened = door_->open_hello(datagram.bytes, kUtc);
    const auto hello = opened.ok() ? decode_lcm_hello(opened->message) : opened.status();
    if (!hello.ok()) {
      ++refused_[intake::index_of(hello.reason())];
      return;
    }
    Bytes welcome = door_->welcome(*opened, encode_lcm(identity()), now());
    (void)intake().claim(hello->session, now(), {opened->robot});
    if (!welcome.empty()) post(kMapChannel, std::move(welcome));
  }

  // As the front-end's transport does.
  void hear(const Datagram& datagram) {
    const auto opened = robot_.open(datagram.channel, datagram.bytes);
    if (!opened || !believe(datagram.channel, *opened)) ++unbelieved_;
  }
  bool believe(std::string_view channel, const access::SealedMessage& opened) {
    if (channel == kAckChannel) {
      const auto ack = decode_lcm_acknowledgement(opened.message);
      if (!ack.ok() || !robot_.heard(ack->boot, opened.seal, now())) return false;
      core().acknowledge(*ack, now());
    } else if (channel == kPoseChannel) {
      const auto news = decode_lcm_pose(opened.message);
      if (!news.ok() || !robot_.heard(news->boot, opened.seal, now())) return false;
      ++news_;
    } else {
      const auto map = decode_lcm_map(opened.message);
      if (!map.ok() || !robot_.heard(map->boot, opened.seal, now())) return false;
      if (robot_.welcome(*map, now()) || !robot_.ready(now())) core().introduce(*map, now());
    }
    return true;
  }

  const double forgeries_per_ms_;
  const bool insider_;
  const access::SealKey secret_{1, 2, 3};
  access::AccessList list_;
  publishing::SealedDaemon robot_;
  Adversary adversary_;
  std::optional<ingest::SealedRobots> door_;
  intake::SteadyTime map_due_{}, hello_due_{};
  std::size_t forged_ = 0, news_ = 0;
  intake::ReasonCounts refused_{};
  std::uint64_t unbelieved_ = 0, not_allowed_before_ = 0;
};

void settles_beside_an_adversary(std::uint64_t seeds, std::uint32_t keyframes) {
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const bool insider = seed % 4 < 2;
    SCOPED_TRACE("seed " + std::to_string(seed) + (insider ? ", a robot of the fleet" : ", a stranger"));
    SealedWorld world(seed, {0.05, 0.05, 0.01, 1, 10}, seed % 2 == 0 ? 0.5 : 3, insider);
    for (int i = 0; i < 200; ++i) world.step();
    std::mt19937_64 random(seed);
    for (std::uint32_t s = 0; s < keyframes; ++s) {
      world.push(s);
      if (s % 25 != 24) continue;
      for (int i = static_cast<int>(random() % 400); i > 0; --i) world.step();
      if (seed % 3 == 0) world.restart();
    }
    ASSERT_TRUE(world.run(120'000)) << world.core().unsettled() << " unsettled";
    const auto outcomes = world.outcomes();
    EXPECT_EQ(outcomes.size(), keyframes);
    for (const auto& [sequence, reason] : outcomes) EXPECT_EQ(reason, Reason::OK) << sequence;
    EXPECT_EQ(world.core().counts().gaps, 0u);
    for (const auto& [reason, count] : world.core().counts().refused)
      ADD_FAILURE() << "the robot takes " << count << " for refused: " << reason_name(reason);
    EXPECT_EQ(world.core().closed(), Reason::OK);
    EXPECT_EQ(world.news(), 0u) << "the daemon had none";
    EXPECT_EQ(world.sink().faults, std::vector<std::string>{});
    EXPECT_GT(world.forged(), 100u);
    EXPECT_GT(world.refused(), world.forged() / 5);
    EXPECT_GT(world.unbelieved(), world.forged() / 5);
    EXPECT_GT(world.refused(Reason::UNAUTHENTICATED), 0u);
    EXPECT_GT(world.refused(Reason::REPLAYED), 0u);
    if (insider) {
      EXPECT_GT(world.not_allowed(), 0u);
    }
  }
}
TEST(SealedSimulation, AdversariesNeitherForgeNorStarve) { settles_beside_an_adversary(12, 150); }
TEST(LongSealedSimulation, AdversariesNeitherForgeNorStarve) { settles_beside_an_adversary(300, 400); }

}  // namespace
}  // namespace relmap::testing
