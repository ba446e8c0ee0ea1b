// The whole way over real LCM on this machine: a publisher with its spool, the daemon's ingest, a journal.
#include <gtest/gtest.h>
#include <sched.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <thread>

#include "frontend/publishing/lcm/lcm_transport.h"
#include "frontend/publishing/publisher.h"
#include "proto/base/crc32c.h"
#include "proto/base/hex.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_link.h"
#include "server/ingest/lcm_ingest.h"
#include "server/ingest/mapper_sink.h"
#include "server/intake/testing/fake_sink.h"
#include "tests/support/patience.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

std::string random_url() {
  std::random_device random;
  return "udpm://239." + std::to_string(random() % 254 + 1) + "." + std::to_string(random() % 254 + 1) + "." +
         std::to_string(random() % 254 + 1) + ":" + std::to_string(20000 + random() % 30000) + "?ttl=0";
}

class LcmIngestTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "relmap_lcm_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
    sink_.sync_at_once = true;
    options_.lcm_url = url_;
    options_.spool = (folder_ / "spool").string();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void start_daemon() {
    BootId boot{};
    boot[0] = ++boots_;
    intake::IngestServerOptions options;
    options.map = map_;
    options.proving = proving_;
    server_ = std::make_unique<intake::IngestServer>(sink_, budget_, boot, options);
    auto ingest = ingest::LcmIngest::start({url_, {who_, secret_}}, *server_, [] { return DaemonStatus{}; });
    ASSERT_TRUE(ingest.ok()) << ingest.status().to_string();
    ingest_ = std::move(*ingest);
    ingest_->use(list_);
  }
  void kill_daemon() {
    ingest_.reset();
    server_.reset();
    sink_.crash();
  }

  access::RobotKey issue(const std::string& robot) {
    const access::SealKey drawn = access::random_key();
    list_.add({access::Grant::Kind::kKey, hex(drawn), {access::Role::kRobot, robot}, INT64_MAX, false});
    return access::robot_key(secret_, drawn);
  }
  Result<std::unique_ptr<publishing::Publisher>> sealed_publisher(const access::RobotKey& key) {
    auto transport = publishing::LcmTransport::open(url_, {key});
    if (!transport.ok()) return transport.status();
    return publishing::Publisher::start(options_, header(), std::move(*transport));
  }
  std::uint64_t not_taken(Reason reason) const {
    const intake::IngestStats stats = server_->stats();
    return stats.messages_refused[intake::index_of(reason)] + stats.parts_refused[intake::index_of(reason)];
  }

  static Keyframe keyframe(const SessionHeader& session, std::uint32_t sequence) {
    Keyframe k = KeyframeSampler(sequence + 1).keyframe();
    k.session = session;
    k.sequence = sequence;
    k.time_us = 1'700'000'000'000'000 + sequence * 100'000LL;
    for (TrackMeasurement& t : k.tracks) t.track.sequence = std::min(t.track.sequence, sequence);
    AppearanceFeature f = k.appearance[0];
    k.appearance.assign(500, f);  // ~80 kB
    return k;
  }
  static SessionHeader header() {
    SessionHeader h = sample_keyframe().session;
    h.uuid = {};
    return h;
  }

  const std::string url_ = random_url();
  std::filesystem::path folder_;
  intake::FakeSink sink_;
  storage::Budget budget_{std::size_t{256} << 20};
  publishing::PublisherOptions options_;
  std::uint8_t boots_ = 0;
  ingest::LcmAuthentication::Who who_ = ingest::LcmAuthentication::Who::kNobody;
  std::set<std::string> proving_;
  const access::SealKey secret_ = access::random_key();
  access::AccessList list_;
  MapIdentity map_{SessionUuid::random(), 1};
  std::unique_ptr<intake::IngestServer> server_;
  std::unique_ptr<ingest::LcmIngest> ingest_;
};

TEST_F(LcmIngestTest, KeyframesArriveThoughTheDaemonDiesOnTheWay) {
  for (const std::size_t part_bytes : {0, 1400}) {
    options_.part_bytes = part_bytes;
    options_.spool = (folder_ / std::to_string(part_bytes)).string();
    auto publisher = publishing::Publisher::start(options_, header());
    ASSERT_TRUE(publisher.ok()) << publisher.status().to_string();
    start_daemon();
    for (std::uint32_t s = 0; s < 60; ++s) {
      ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), s)).ok());
      if (s == 30) {
        kill_daemon();
        start_daemon();
      }
    }
    const publishing::PublishSummary summary = (*publisher)->finish(steady_clock::now() + kPatience);
    EXPECT_TRUE(summary.all_settled());
    EXPECT_EQ(summary.settled, 60u);
    EXPECT_TRUE(summary.refused.empty());
    EXPECT_EQ(sink_.faults, std::vector<std::string>{});
    kill_daemon();
  }
  EXPECT_EQ(sink_.journal().size(), 120u);
}

// The same with seals, in packets of a network.
TEST_F(LcmIngestTest, SealedKeyframesArriveThoughTheDaemonDiesOnTheWay) {
  who_ = ingest::LcmAuthentication::Who::kAll;
  for (const std::size_t part_bytes : {std::size_t{0}, std::size_t{kNetworkPartBytes}}) {
    options_.part_bytes = part_bytes;
    options_.spool = (folder_ / std::to_string(part_bytes)).string();
    auto publisher = sealed_publisher(issue(header().robot));
    ASSERT_TRUE(publisher.ok()) << publisher.status().to_string();
    start_daemon();
    for (std::uint32_t s = 0; s < 60; ++s) {
      ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), s)).ok());
      if (s == 30) {
        kill_daemon();
        start_daemon();
      }
    }
    const publishing::PublishSummary summary = (*publisher)->finish(steady_clock::now() + kPatience);
    EXPECT_TRUE(summary.all_settled());
    EXPECT_EQ(summary.settled, 60u);
    EXPECT_TRUE(summary.refused.empty());
    EXPECT_TRUE((*publisher)->end_session(steady_clock::now() + kPatience));
    EXPECT_TRUE((*publisher)->trouble().ok());
    kill_daemon();
  }
  EXPECT_EQ(sink_.journal().size(), 122u);
}

TEST_F(LcmIngestTest, WhoeverHasNoKeyIsToldWhyNothingIsSettled) {
  who_ = ingest::LcmAuthentication::Who::kAll;
  start_daemon();
  {
    auto publisher = publishing::Publisher::start(options_, header());
    ASSERT_TRUE(publisher.ok()) << publisher.status().to_string();
    ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), 0)).ok());
    const auto deadline = steady_clock::now() + kPatience;
    while ((*publisher)->trouble().ok() && steady_clock::now() < deadline)
      std::this_thread::sleep_for(milliseconds(20));
    EXPECT_EQ((*publisher)->trouble().reason(), Reason::UNAUTHENTICATED);
    EXPECT_GE(not_taken(Reason::UNAUTHENTICATED), 1u);
  }
  options_.spool += ".unknown";
  auto publisher = sealed_publisher(access::robot_key(secret_, access::random_key()));
  ASSERT_TRUE(publisher.ok()) << publisher.status().to_string();
  ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), 0)).ok());
  const auto deadline = steady_clock::now() + kPatience;
  while ((*publisher)->trouble().ok() && steady_clock::now() < deadline) std::this_thread::sleep_for(milliseconds(20));
  EXPECT_EQ((*publisher)->trouble().reason(), Reason::UNAUTHENTICATED);
  EXPECT_EQ((*publisher)->progress().settled, 0u);
  EXPECT_TRUE(sink_.journal().empty());
  // Once the key is issued it goes on by itself, and when it is revoked it ends.
  const access::RobotKey key = issue(header().robot);
  ingest_->use(list_);
  options_.spool += ".known";
  auto known = sealed_publisher(key);
  ASSERT_TRUE((*known)->push(keyframe((*known)->session(), 0)).ok());
  EXPECT_TRUE((*known)->finish(steady_clock::now() + kPatience).all_settled());
  EXPECT_EQ(sink_.journal().size(), 1u);
}

TEST_F(LcmIngestTest, ARobotCannotSendForAnother) {
  who_ = ingest::LcmAuthentication::Who::kAll;
  const access::RobotKey thief = issue("thief");
  start_daemon();
  auto publisher = sealed_publisher(thief);  // its keyframes say that they are of the header's robot
  ASSERT_TRUE(publisher.ok()) << publisher.status().to_string();
  ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), 0)).ok());
  const publishing::PublishSummary summary = (*publisher)->finish(steady_clock::now() + kPatience);
  EXPECT_EQ(summary.refused, (std::map<Reason, std::uint64_t>{{Reason::NOT_ALLOWED, 1}}));
  EXPECT_TRUE(sink_.journal().empty());
}

// Some robots must prove who they are; others are older and cannot.
TEST_F(LcmIngestTest, ThoseWhoMustProveWhoTheyAreCanBeListed) {
  who_ = ingest::LcmAuthentication::Who::kSome;
  proving_ = {"cart"};
  const access::RobotKey key = issue("cart");
  start_daemon();
  auto old_robot = publishing::Publisher::start(options_, header());
  ASSERT_TRUE(old_robot.ok()) << old_robot.status().to_string();
  ASSERT_TRUE((*old_robot)->push(keyframe((*old_robot)->session(), 0)).ok());
  EXPECT_TRUE((*old_robot)->finish(steady_clock::now() + kPatience).all_settled());
  EXPECT_EQ(sink_.journal().size(), 1u);

  SessionHeader cart = header();
  cart.robot = "cart";
  options_.spool += ".cart";
  auto transport = publishing::LcmTransport::open(url_, {key});
  ASSERT_TRUE(transport.ok()) << transport.status().to_string();
  auto publisher = publishing::Publisher::start(options_, cart, std::move(*transport));
  ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), 0)).ok());
  EXPECT_TRUE((*publisher)->finish(steady_clock::now() + kPatience).all_settled());
  EXPECT_EQ(sink_.journal().size(), 2u);

  // The same robot without its key, in the session and in a new one.
  auto link = LcmLink::open(url_, {}).or_throw();
  const SessionUuid session = (*publisher)->session().uuid, other = SessionUuid::random();
  const auto deadline = steady_clock::now() + kPatience;
  while (not_taken(Reason::NOT_ALLOWED) < 20 && steady_clock::now() < deadline) {
    link->publish(kGapChannel, encode_lcm(Gap{session, 1, 5, Reason::DROPPED_BY_ROBOT}));
    link->publish(kEndChannel, encode_lcm(SessionEnd{session, 1}));
    SessionHeader stolen = cart;
    for (const SessionUuid& uuid : {session, other}) {
      stolen.uuid = uuid;
      const Bytes payload = encode_keyframe(keyframe(stolen, 1));
      for (std::uint32_t i = 0; i < count_parts(payload.size(), kMaxPartBytes); ++i)
        link->publish(kKeyframeChannel, encode_lcm(cut_part(uuid, 1, payload, crc32c(payload), kMaxPartBytes, i)));
    }
    std::this_thread::sleep_for(milliseconds(5));
  }
  EXPECT_GE(not_taken(Reason::NOT_ALLOWED), 20u);
  EXPECT_EQ(sink_.journal().size(), 2u);
}

// Seals are not looked at, so that recordings of sealed messages can be replayed.
TEST_F(LcmIngestTest, WithoutAuthenticationSealsAreNoHindrance) {
  start_daemon();
  auto link = LcmLink::open(url_, {}).or_throw();
  SessionHeader session = header();
  session.uuid = SessionUuid::random();
  const Bytes payload = encode_keyframe(keyframe(session, 0));
  access::Sealer sealer(access::random_key());
  const auto deadline = steady_clock::now() + kPatience;
  while (sink_.journal().empty() && steady_clock::now() < deadline) {
    for (std::uint32_t i = 0; i < count_parts(payload.size(), 30000); ++i) {
      Bytes datagram = encode_lcm(cut_part(session.uuid, 0, payload, crc32c(payload), 30000, i));
      sealer.seal(access::SealedBy::kRobot, kKeyframeChannel, {}, {}, datagram);
      link->publish(kKeyframeChannel, datagram);
    }
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_EQ(sink_.journal().size(), 1u);
}

// Two daemons, of which both know the robot's key: the robot keeps to the one that it has met first, or to the map that
// it was told, and the other takes nothing of it.
TEST_F(LcmIngestTest, ARobotKeepsToOneOfTwoDaemons) {
  who_ = ingest::LcmAuthentication::Who::kAll;
  const access::RobotKey key = issue(header().robot);
  start_daemon();
  intake::FakeSink other_sink;
  other_sink.sync_at_once = true;
  intake::IngestServerOptions other_options;
  other_options.map = {SessionUuid::random(), 1};
  intake::IngestServer other_server(other_sink, budget_, BootId{99}, other_options);
  const auto other =
      ingest::LcmIngest::start({url_, {who_, secret_}}, other_server, [] { return DaemonStatus{}; }).or_throw();
  other->use(list_);
  for (const bool first : {true, false}) {
    options_.map = first ? map_.uuid : other_options.map.uuid;
    options_.spool = (folder_ / (first ? "first" : "second")).string();
    auto publisher = sealed_publisher(key);
    ASSERT_TRUE(publisher.ok()) << publisher.status().to_string();
    for (std::uint32_t s = 0; s < 20; ++s) {
      ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), s)).ok());
      std::this_thread::sleep_for(milliseconds(5));
    }
    EXPECT_TRUE((*publisher)->finish(steady_clock::now() + kPatience).all_settled());
    EXPECT_TRUE((*publisher)->trouble().ok()) << (*publisher)->trouble().to_string();
    EXPECT_EQ(sink_.journal().size(), 20u);
    EXPECT_EQ(other_sink.journal().size(), first ? 0u : 20u);
  }
  options_.map = {};
  options_.spool = (folder_ / "third").string();
  auto publisher = sealed_publisher(key);
  for (std::uint32_t s = 0; s < 20; ++s) ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), s)).ok());
  EXPECT_TRUE((*publisher)->finish(steady_clock::now() + kPatience).all_settled());
  EXPECT_EQ(sink_.journal().size() + other_sink.journal().size(), 60u);
  EXPECT_TRUE(sink_.journal().size() == 20u || other_sink.journal().size() == 20u) << "one of them has all";
}

TEST_F(LcmIngestTest, FrontEndThatDiesIsContinuedFromItsSpool) {
  SessionUuid uuid;
  {
    auto publisher = publishing::Publisher::start(options_, header());
    ASSERT_TRUE(publisher.ok()) << publisher.status().to_string();
    uuid = (*publisher)->session().uuid;
    for (std::uint32_t s = 0; s < 10; ++s) ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), s)).ok());
  }
  start_daemon();
  auto publisher = publishing::Publisher::start(options_, header());
  ASSERT_TRUE(publisher.ok()) << publisher.status().to_string();
  EXPECT_EQ((*publisher)->session().uuid, uuid);
  EXPECT_EQ((*publisher)->next_sequence(), 10u);
  EXPECT_EQ((*publisher)->last_keyframe()->sequence, 9u);
  EXPECT_EQ((*publisher)->progress().spooled, 10u);
  ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), 10)).ok());
  EXPECT_TRUE((*publisher)->finish(steady_clock::now() + kPatience).all_settled());
  EXPECT_EQ(sink_.journal().size(), 11u);
}

TEST_F(LcmIngestTest, ARobotHearsTheNewsOfItsOwnKeyframes) {
  start_daemon();
  auto publisher = publishing::Publisher::start(options_, header());
  ASSERT_TRUE(publisher.ok()) << publisher.status().to_string();
  std::mutex mutex;
  std::vector<PoseNews> heard;
  (*publisher)->hear([&](const PoseNews& news) {
    const std::lock_guard lock(mutex);
    heard.push_back(news);
  });
  ASSERT_TRUE((*publisher)->push(keyframe((*publisher)->session(), 0)).ok());
  ASSERT_TRUE((*publisher)->finish(steady_clock::now() + kPatience).all_settled());

  storage::Edge closure;
  closure.a = {1, 3};
  closure.b = {1, 0};
  closure.verification = storage::Verification::kStereo;
  closure.T_ab.t = Vector3(1, 2, 3);
  closure.covariance = Matrix6::Identity();
  storage::Edge other = closure;  // of another robot
  other.b.session = 2;
  const auto view = sink_.view();
  EXPECT_FALSE(ingest::closure_news(*view, other)) << "the map does not know that session";
  storage::Edge by_appearance = closure;
  by_appearance.verification = storage::Verification::kEpipolar;
  EXPECT_FALSE(ingest::closure_news(*view, by_appearance)) << "it has no transform";
  const auto told = ingest::closure_news(*view, closure).value();
  EXPECT_EQ(told.robot, header().robot);
  PoseNews news = told.news;
  EXPECT_EQ(news.kind, PoseNews::Kind::kClosure);
  closure.state = storage::EdgeState::kCandidate;
  EXPECT_EQ(ingest::closure_news(*view, closure)->news.kind, PoseNews::Kind::kLocalised);
  closure.state = storage::EdgeState::kRemoved;
  EXPECT_EQ(ingest::closure_news(*view, closure)->news.kind, PoseNews::Kind::kClosureOut);
  const auto deadline = steady_clock::now() + kPatience;
  const auto count = [&] {
    const std::lock_guard lock(mutex);
    return heard.size();
  };
  while (count() == 0 && steady_clock::now() < deadline) {
    PoseNews foreign = news;
    foreign.session.bytes[0] ^= 1;
    server_->tell(foreign, "other");
    server_->tell(news, "cart");
    std::this_thread::sleep_for(milliseconds(20));
  }
  (*publisher)->hear({});
  ASSERT_FALSE(heard.empty());
  for (const PoseNews& one : heard) {
    EXPECT_EQ(one.session, (*publisher)->session().uuid);
    EXPECT_EQ(one.boot, server_->identity().boot);
    EXPECT_GT(one.time_us, 1'600'000'000'000'000);
    EXPECT_EQ(one.frame, (FrameId{1, 3}));
    EXPECT_EQ(one.keyframe, (FrameId{1, 0}));
    EXPECT_EQ(one.T_frame_keyframe.t, closure.T_ab.t);
  }
}

TEST_F(LcmIngestTest, ForeignMessagesAreCountedAndHurtNobody) {
  start_daemon();
  auto link = LcmLink::open(url_, {});
  ASSERT_TRUE(link.ok()) << link.status().to_string();
  Bytes part = encode_lcm(cut_part(SessionUuid::random(), 0, Bytes(3000, 7), 1, 1400, 0));
  Bytes other_protocol = part;
  other_protocol[9] = 2;
  Bytes absurd = part;
  std::fill_n(absurd.begin() + 68, 4, std::uint8_t{0x7f});  // the length of its data
  const auto count = [&](Reason reason) { return server_->stats().messages_refused[intake::index_of(reason)]; };
  const auto deadline = steady_clock::now() + kPatience;
  while ((count(Reason::CORRUPT) < 2 || count(Reason::UNKNOWN_PROTOCOL_VERSION) == 0) &&
         steady_clock::now() < deadline) {
    (*link)->publish(kKeyframeChannel, Bytes(10, 1));
    (*link)->publish(kKeyframeChannel, absurd);
    (*link)->publish(kKeyframeChannel, other_protocol);
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_GE(count(Reason::CORRUPT), 2u);
  EXPECT_GE(count(Reason::UNKNOWN_PROTOCOL_VERSION), 1u);
}

// A network namespace of its own has no multicast route; only root can make one.
TEST(MulticastProbe, NamesTheMissingRouteAndWhatMendsIt) {
  const std::string url = *complete_lcm_url(random_url());
  EXPECT_TRUE(probe_multicast(url).ok());
  const pid_t child = ::fork();
  if (child == 0) {
    if (::unshare(CLONE_NEWNET) != 0) ::_exit(2);
    const Status status = LcmLink::open(url, {}).status();
    ::_exit(status.reason() == Reason::NO_MULTICAST_ROUTE &&
                    status.message().find("ip route add 224.0.0.0/4 dev lo") != std::string::npos
                ? 0
                : 1);
  }
  int outcome = 0;
  ASSERT_EQ(::waitpid(child, &outcome, 0), child);
  ASSERT_TRUE(WIFEXITED(outcome));
  if (WEXITSTATUS(outcome) == 2)
    std::printf("no network namespace may be made here: only the route that there is was tried\n");
  else
    EXPECT_EQ(WEXITSTATUS(outcome), 0);
}

TEST(LcmUrl, IsCompletedOrRefusedByName) {
  EXPECT_EQ(*complete_lcm_url("udpm://239.1.2.3:7000"), "udpm://239.1.2.3:7000?ttl=0&recv_buf_size=4194304");
  EXPECT_EQ(*complete_lcm_url("udpm://239.1.2.3:7000?ttl=1"), "udpm://239.1.2.3:7000?ttl=1&recv_buf_size=4194304");
  EXPECT_FALSE(stays_on_this_machine(*complete_lcm_url("udpm://239.1.2.3:7000?ttl=1")));
  EXPECT_TRUE(stays_on_this_machine(*complete_lcm_url("udpm://239.1.2.3:7000")));
  EXPECT_EQ(complete_lcm_url("tcp:239.1.2.3").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(LcmLink::open("udpm://10.0.0.1:7000", {}).reason(), Reason::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace relmap::testing
