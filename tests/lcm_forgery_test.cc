// Forgeries over real LCM: a robot publishes its keyframes, sealed, while an attacker on the same group sends in the
// robot's and the daemon's name whatever it can make of what it hears. Nothing of that may be believed.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <numeric>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "frontend/publishing/lcm/lcm_transport.h"
#include "frontend/publishing/publisher.h"
#include "proto/base/hex.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_link.h"
#include "proto/wire/lcm_messages.h"
#include "server/ingest/lcm_ingest.h"
#include "server/intake/testing/fake_sink.h"
#include "tests/support/lcm_attacker.h"
#include "tests/support/patience.h"
#include "tests/support/running_daemon.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// A robot's link, which counts what comes on the channels that its transport hears.
class CountingLink {
 public:
  CountingLink(const std::string& url, const access::RobotKey& key) {
    transport_ = std::make_unique<publishing::LcmTransport>(
        [this](const char* channel, const Bytes& datagram) { link_->publish(channel, datagram); }, /*local=*/true,
        publishing::LcmTransportOptions{key});
    LcmLink::Handlers handlers;
    for (const char* channel : publishing::LcmTransport::heard_channels())
      handlers.emplace_back(channel, [this, channel, to = transport_.get()](ByteSpan datagram) {
        ++heard_;
        to->hear(channel, datagram);
      });
    link_ = LcmLink::open(url, std::move(handlers)).or_throw();
  }

  // For the publisher, which is to be destroyed after stop() and before this object.
  std::unique_ptr<publishing::LcmTransport> take_transport() { return std::move(transport_); }
  void stop() { link_->stop(); }
  std::size_t heard() const { return heard_; }

 private:
  std::atomic<std::size_t> heard_ = 0;
  std::unique_ptr<publishing::LcmTransport> transport_;
  std::unique_ptr<LcmLink> link_;
};

class LcmForgery : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "relmap_forgery_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    sink_.sync_at_once = true;
    cart_ = issue("cart");
    thief_ = issue("thief");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  access::RobotKey issue(const std::string& robot) {
    const access::SealKey drawn = access::random_key();
    list_.add({access::Grant::Kind::kKey, hex(drawn), {access::Role::kRobot, robot}, INT64_MAX, false});
    return access::robot_key(secret_, drawn);
  }

  void start_daemon() {
    const BootId boot = SessionUuid::random().bytes;
    intake::IngestServerOptions options;
    options.map = map_;
    server_ = std::make_unique<intake::IngestServer>(sink_, budget_, boot, options);
    ingest::LcmOptions lcm{url_, {ingest::LcmAuthentication::Who::kAll, secret_}};
    ingest_ = ingest::LcmIngest::start(lcm, *server_, [] { return DaemonStatus{}; }).or_throw();
    ingest_->use(list_);
  }
  void kill_daemon() {
    ingest_.reset();
    add(refused_before_, server_->stats());
    server_.reset();
    sink_.crash();
  }

  Keyframe keyframe(std::uint32_t sequence) const {
    Keyframe k = KeyframeSampler(sequence + 1).keyframe();
    k.session = header_;
    k.sequence = sequence;
    k.time_us = 1'700'000'000'000'000 + sequence * 100'000LL;
    for (TrackMeasurement& t : k.tracks) t.track.sequence = std::min(t.track.sequence, sequence);
    return k;
  }

  // Publishes `count` keyframes with two restarts of the daemon on the way, during an attack of so many messages, of
  // which the daemon has refused so large a share that it cannot have missed them, and the robot heard as many.
  void run(std::size_t messages, std::uint32_t count, bool insider) {
    // Of an attack, four ninths are what robots say, and as much what the daemon says. LCM loses some of it.
    const std::size_t refused = messages / 5, heard = messages / 5;
    header_ = sample_keyframe().session;
    header_.robot = "cart";
    header_.uuid = SessionUuid::random();
    start_daemon();
    publishing::PublisherOptions options;
    options.spool = (folder_ / "spool").string();
    CountingLink robot(url_, cart_);
    const auto publisher = publishing::Publisher::start(options, header_, robot.take_transport()).or_throw();
    std::mutex mutex;
    std::vector<PoseNews> news;
    publisher->hear([&](const PoseNews& one) {
      const std::lock_guard lock(mutex);
      news.push_back(one);
    });
    // A robot of the fleet may claim a session as soon as it has heard of it, so the robot that it is of comes first.
    if (insider) {
      EXPECT_TRUE(publisher->push(keyframe(0)).ok());
      while (publisher->progress().unsettled > 0) std::this_thread::sleep_for(milliseconds(1));
    }
    LcmAttacker attacker(url_, {header_.uuid}, 1);
    if (insider) attacker.use(thief_);
    std::atomic<bool> attacked = false;
    std::thread attack([&] {
      while (!attacked) {
        for (int i = 0; i < 200; ++i) attacker.forge();
        std::this_thread::sleep_for(milliseconds(1));  // LCM's queues hold a thousand messages
      }
    });
    // How much of the attack is over; keyframes are published all the while.
    const auto share = [&] {
      const auto of = [](std::size_t part, std::size_t whole) {
        return static_cast<double>(part) / static_cast<double>(whole);
      };
      return std::min({of(attacker.sent(), messages), of(sum(refused_by_daemon()), refused), of(robot.heard(), heard)});
    };
    const auto until = steady_clock::now() + 2 * kPatience;
    for (std::uint32_t s = insider ? 1 : 0; s < count; ++s) {
      while (share() < static_cast<double>(s) / count && steady_clock::now() < until)
        std::this_thread::sleep_for(milliseconds(2));
      EXPECT_TRUE(publisher->push(keyframe(s)).ok());
      if (s % (count / 3) != count / 6) continue;
      kill_daemon();
      // Nobody is there who could settle anything: the spool keeps what is not settled. What the daemon said last may
      // still be on its way.
      std::uint64_t unsettled = publisher->progress().unsettled;
      const auto settles = [&] {
        std::this_thread::sleep_for(milliseconds(300));
        return std::exchange(unsettled, publisher->progress().unsettled) != unsettled;
      };
      while (settles()) {
      }
      for (std::uint32_t more = 0; more < 5; ++more) EXPECT_TRUE(publisher->push(keyframe(++s)).ok());
      const std::size_t said = attacker.sent();
      std::this_thread::sleep_for(milliseconds(300));
      EXPECT_GE(publisher->progress().unsettled, unsettled + 5) << "a forged acknowledgement has emptied the spool";
      EXPECT_GT(attacker.sent(), said) << "the attack does not go on while the daemon is dead";
      start_daemon();
    }
    while (share() < 1 && steady_clock::now() < until) std::this_thread::sleep_for(milliseconds(2));
    const publishing::PublishSummary summary = publisher->finish(steady_clock::now() + kPatience);
    EXPECT_TRUE(summary.all_settled()) << summary.unsettled << " are not settled; " << publisher->trouble().to_string()
                                       << "; the daemon has refused" << text_of(refused_by_daemon());
    EXPECT_TRUE(publisher->end_session(steady_clock::now() + kPatience));
    attacked = true;
    attack.join();
    EXPECT_EQ(summary.settled, count);
    EXPECT_EQ(summary.gaps, 0u);
    EXPECT_TRUE(summary.refused.empty());
    EXPECT_TRUE(summary.session.ok()) << summary.session.to_string();
    std::printf("sent %zu, of these sealed by a robot %zu; the daemon refused%s; the robot heard %zu\n",
                attacker.sent(), attacker.sealed(), text_of(refused_by_daemon()).c_str(), robot.heard());
    EXPECT_GE(attacker.sent(), messages);
    EXPECT_GE(sum(refused_by_daemon()), refused) << "the attack has not arrived";
    EXPECT_GE(robot.heard(), heard) << "the attack has not arrived";
    EXPECT_GT(attacker.heard(), 100u) << "the attacker heard nothing that it could use";
    const auto of_reason = [&](Reason reason) { return refused_by_daemon()[intake::index_of(reason)]; };
    EXPECT_GT(of_reason(Reason::UNAUTHENTICATED), 0u);
    EXPECT_GT(of_reason(Reason::REPLAYED), 0u) << "nothing was sent again as it was heard";
    if (insider) {
      EXPECT_GT(of_reason(Reason::NOT_ALLOWED), messages / 50) << "nobody takes the attacker for a robot of the fleet";
    }
    publisher->hear({});
    for (const PoseNews& one : news) EXPECT_NE(one.kind, PoseNews::Kind::kSlowDown);
    robot.stop();
    kill_daemon();
    check_journal(count);
  }

  static void add(intake::ReasonCounts& counts, const intake::IngestStats& stats) {
    for (std::size_t i = 0; i < counts.size(); ++i) counts[i] += stats.messages_refused[i] + stats.parts_refused[i];
  }
  // Over all its lives.
  intake::ReasonCounts refused_by_daemon() const {
    intake::ReasonCounts counts = refused_before_;
    if (server_) add(counts, server_->stats());
    return counts;
  }
  static std::size_t sum(const intake::ReasonCounts& counts) {
    return std::accumulate(counts.begin(), counts.end(), std::size_t{0});
  }
  static std::string text_of(const intake::ReasonCounts& counts) {
    std::string text;
    for (std::size_t i = 0; i < counts.size(); ++i)
      if (counts[i] > 0)
        text += " " + std::string(reason_name(static_cast<Reason>(i))) + " " + std::to_string(counts[i]);
    return text;
  }

  // What was published, as it was published, once, and so many ends.
  void check_journal(std::uint32_t count, std::uint32_t expected_ends = 1) const {
    EXPECT_EQ(sink_.faults, std::vector<std::string>{});
    std::uint32_t next = 0, ends = 0, others = 0;
    for (const storage::JournalRecord& record : sink_.journal()) {
      if (const auto* stored = std::get_if<storage::KeyframeRecord>(&record)) {
        EXPECT_EQ(stored->payload, encode_keyframe(keyframe(next)));
        ++next;
      } else {
        ++(std::holds_alternative<storage::SetSessionStateRecord>(record) ? ends : others);
      }
    }
    EXPECT_EQ(next, count);
    EXPECT_EQ(ends, expected_ends);
    EXPECT_EQ(others, 0u) << "gaps or refusals";
  }

  const std::string url_ = random_lcm_url();
  std::filesystem::path folder_;
  const access::SealKey secret_ = access::random_key();
  access::AccessList list_;
  access::RobotKey cart_, thief_;
  SessionHeader header_;
  MapIdentity map_{SessionUuid::random(), 1};
  intake::FakeSink sink_;
  storage::Budget budget_{std::size_t{256} << 20};
  intake::ReasonCounts refused_before_{};  // by daemons that have been killed
  std::unique_ptr<intake::IngestServer> server_;
  std::unique_ptr<ingest::LcmIngest> ingest_;
};
using LongLcmForgery = LcmForgery;

// Who is faster than the robot itself has its session, and the robot keeps what it has: nothing that settles what the
// other sends is said to it.
TEST_F(LcmForgery, ARobotWhoseSessionAnotherHasTakenKeepsItsKeyframes) {
  header_ = sample_keyframe().session;
  header_.uuid = SessionUuid::random();
  start_daemon();
  header_.robot = "thief";
  CountingLink taking(url_, thief_);
  publishing::PublisherOptions options;
  options.spool = (folder_ / "thief").string();
  const auto thief = publishing::Publisher::start(options, header_, taking.take_transport()).or_throw();
  EXPECT_TRUE(thief->push(keyframe(0)).ok());
  while (thief->progress().unsettled > 0) std::this_thread::sleep_for(milliseconds(1));
  header_.robot = "cart";
  CountingLink robbed(url_, cart_);
  options.spool = (folder_ / "cart").string();
  const auto cart = publishing::Publisher::start(options, header_, robbed.take_transport()).or_throw();
  constexpr std::uint32_t kKept = 30, kTaken = 20;
  for (std::uint32_t s = 0; s < kKept; ++s) EXPECT_TRUE(cart->push(keyframe(s)).ok());
  const auto until = steady_clock::now() + kPatience;
  while (refused_by_daemon()[intake::index_of(Reason::NOT_ALLOWED)] == 0 && steady_clock::now() < until)
    std::this_thread::sleep_for(milliseconds(1));
  header_.robot = "thief";
  for (std::uint32_t s = 1; s < kTaken; ++s) {  // each is acknowledged
    EXPECT_TRUE(thief->push(keyframe(s)).ok());
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_TRUE(thief->finish(until).all_settled());
  EXPECT_EQ(cart->progress().unsettled, kKept);
  robbed.stop();
  taking.stop();
  kill_daemon();
  check_journal(kTaken, 0);
}

TEST_F(LcmForgery, NothingThatAStrangerSendsIsBelieved) { run(100'000, 300, false); }
TEST_F(LcmForgery, NothingThatAnotherRobotSendsIsBelieved) { run(30'000, 300, true); }
TEST_F(LongLcmForgery, NothingThatAStrangerSendsIsBelieved) { run(1'000'000, 3000, false); }
TEST_F(LongLcmForgery, NothingThatAnotherRobotSendsIsBelieved) { run(300'000, 3000, true); }

}  // namespace
}  // namespace relmap::testing
