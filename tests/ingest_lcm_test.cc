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
#include <string>
#include <thread>

#include "frontend/publishing/publisher.h"
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
    server_ = std::make_unique<intake::IngestServer>(sink_, budget_, boot);
    auto ingest = ingest::LcmIngest::start(url_, *server_, [] { return DaemonStatus{}; });
    ASSERT_TRUE(ingest.ok()) << ingest.status().to_string();
    ingest_ = std::move(*ingest);
  }
  void kill_daemon() {
    ingest_.reset();
    server_.reset();
    sink_.crash();
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
  PoseNews news = ingest::closure_news(*view, closure).value();
  EXPECT_EQ(news.kind, PoseNews::Kind::kClosure);
  closure.state = storage::EdgeState::kCandidate;
  EXPECT_EQ(ingest::closure_news(*view, closure)->kind, PoseNews::Kind::kLocalised);
  closure.state = storage::EdgeState::kRemoved;
  EXPECT_EQ(ingest::closure_news(*view, closure)->kind, PoseNews::Kind::kClosureOut);
  const auto deadline = steady_clock::now() + kPatience;
  const auto count = [&] {
    const std::lock_guard lock(mutex);
    return heard.size();
  };
  while (count() == 0 && steady_clock::now() < deadline) {
    PoseNews foreign = news;
    foreign.session.bytes[0] ^= 1;
    server_->tell(foreign);
    server_->tell(news);
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
