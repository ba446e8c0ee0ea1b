// Publisher and IngestServer with all their threads, over a transport within the process that loses some of what it
// carries. Runs under ThreadSanitizer.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <random>
#include <thread>

#include "frontend/publishing/publisher.h"
#include "proto/keyframe/keyframe_samples.h"
#include "server/intake/ingest_server.h"
#include "server/intake/testing/fake_sink.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

// Where daemons come and go.
class Wire {
 public:
  void connect(intake::IngestServer* server) {
    const std::lock_guard lock(mutex_);
    server_ = server;
  }
  template <typename Message>
  void carry(const Message& message) {
    const std::lock_guard lock(mutex_);
    if (!server_ || std::uniform_real_distribution<double>(0, 1)(random_) < loss) return;
    if constexpr (std::is_same_v<Message, KeyframePart>)
      server_->take_part(message);
    else
      server_->take_gap(message, {});
  }
  std::atomic<double> loss = 0;

 private:
  std::mutex mutex_;
  intake::IngestServer* server_ = nullptr;
  std::mt19937 random_{7};
};

class Listeners {
 public:
  void set(publishing::PublishTransport::Listener listener) {
    const std::lock_guard lock(mutex_);
    listener_ = std::move(listener);
  }
  void say(const Acknowledgement& ack) {
    const std::lock_guard lock(mutex_);
    if (listener_.acknowledged) listener_.acknowledged(ack);
  }
  void say(const PoseNews& news) {
    const std::lock_guard lock(mutex_);
    if (listener_.news) listener_.news(news);
  }

 private:
  std::mutex mutex_;
  publishing::PublishTransport::Listener listener_;
};

class WireTransport final : public publishing::PublishTransport {
 public:
  WireTransport(Wire& wire, Listeners& listeners) : wire_(wire), listeners_(listeners) {}
  void send(const KeyframePart& part) override { wire_.carry(part); }
  void send(const Gap& gap) override { wire_.carry(gap); }
  void send(const SessionEnd& end) override {
    ++ends;
    PoseNews news;
    news.session = end.session;
    news.kind = PoseNews::Kind::kEnded;
    if (ends > 2) listeners_.say(news);
  }
  int ends = 0;  // said, before one is noted
  void listen(Listener listener) override { listeners_.set(std::move(listener)); }
  void stop() override { listeners_.set({}); }

 private:
  Wire& wire_;
  Listeners& listeners_;
};

class IngestThreadsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "relmap_threads_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    options_.spool = name;
    options_.spool_bytes = std::size_t{1} << 20;
    syncer_ = std::thread([this] {
      while (!stop_) {
        sink_.sync();
        std::this_thread::sleep_for(milliseconds(1));
      }
    });
  }
  void TearDown() override {
    stop_daemon();
    stop_ = true;
    syncer_.join();
    std::filesystem::remove_all(options_.spool);
  }

  void start_daemon() {
    BootId boot{};
    boot[0] = ++boots_;
    server_ = std::make_unique<intake::IngestServer>(sink_, budget_, boot);
    subscription_ =
        server_->subscribe({[this](const Acknowledgement& ack, const auto&) { listeners_.say(ack); }, {}, {}});
    wire_.connect(server_.get());
  }
  void stop_daemon() {
    wire_.connect(nullptr);
    subscription_.reset();
    server_.reset();
  }
  std::unique_ptr<publishing::Publisher> start_publisher(const SessionUuid& uuid = {}) {
    SessionHeader header = sample_keyframe().session;
    header.uuid = uuid;
    auto publisher = publishing::Publisher::start(options_, header, std::make_unique<WireTransport>(wire_, listeners_));
    EXPECT_TRUE(publisher.ok()) << publisher.status().to_string();
    return std::move(*publisher);
  }
  static Keyframe keyframe(const SessionHeader& session, std::uint32_t sequence) {
    Keyframe k = KeyframeSampler(sequence + 1).keyframe();
    k.session = session;
    k.sequence = sequence;
    k.time_us = 1'700'000'000'000'000 + sequence * 100'000LL;
    for (TrackMeasurement& t : k.tracks) t.track.sequence = std::min(t.track.sequence, sequence);
    const AppearanceFeature f = k.appearance[0];
    k.appearance.assign(200, f);  // ~30 kB
    return k;
  }

  publishing::PublisherOptions options_;
  intake::FakeSink sink_;
  storage::Budget budget_{std::size_t{256} << 20};
  Wire wire_;
  Listeners listeners_;
  std::uint8_t boots_ = 0;
  std::unique_ptr<intake::IngestServer> server_;
  std::unique_ptr<intake::IngestServer::Subscription> subscription_;
  std::atomic<bool> stop_ = false;
  std::thread syncer_;
};

TEST_F(IngestThreadsTest, EverythingSettlesThroughLossAndRestarts) {
  wire_.loss = 0.05;
  const auto publisher = start_publisher();
  start_daemon();
  std::atomic<bool> asking = true;
  std::thread reader([&] {
    while (asking) {
      (void)publisher->progress();
      std::this_thread::sleep_for(milliseconds(1));
    }
  });
  for (std::uint32_t s = 0; s < 100; ++s) {  // three times what the spool holds: push() waits
    ASSERT_TRUE(publisher->push(keyframe(publisher->session(), s)).ok());
    if (s == 50) {
      stop_daemon();
      start_daemon();
    }
  }
  const publishing::PublishSummary summary = publisher->finish(steady_clock::now() + seconds(60));
  asking = false;
  reader.join();
  EXPECT_TRUE(summary.all_settled());
  EXPECT_EQ(summary.settled, 100u);
  EXPECT_EQ(summary.pushed, 100u);
  EXPECT_GT(summary.parts_resent + summary.resent, 0u);
  EXPECT_GE(sink_.journal().size(), 100u);
  EXPECT_EQ(sink_.faults, std::vector<std::string>{});
  EXPECT_EQ(publisher->push(keyframe(publisher->session(), 100)).reason(), Reason::SHUTTING_DOWN);
}

TEST_F(IngestThreadsTest, TheSessionEndIsRepeatedUntilItIsAcknowledged) {
  const auto publisher = start_publisher();
  start_daemon();
  ASSERT_TRUE(publisher->push(keyframe(publisher->session(), 0)).ok());
  EXPECT_TRUE(publisher->finish(steady_clock::now() + seconds(60)).all_settled());
  const auto begin = steady_clock::now();
  EXPECT_TRUE(publisher->end_session(begin + seconds(60)));
  EXPECT_GE(steady_clock::now() - begin, milliseconds(400));
}

TEST_F(IngestThreadsTest, AnUnacknowledgedSessionEndDoesNotBlock) {
  const auto publisher = start_publisher();
  EXPECT_FALSE(publisher->end_session(steady_clock::now() + milliseconds(100)));
  publisher->interrupt();
  EXPECT_FALSE(publisher->end_session(steady_clock::now() + seconds(60)));
}

TEST_F(IngestThreadsTest, WithoutADiskARunBeginsAnewAndSettlesTheRest) {
  options_.in_memory = true;
  start_daemon();
  SessionUuid uuid;
  uuid.bytes.fill(5);
  const auto run = [&](std::uint32_t keyframes) {
    const auto publisher = start_publisher(uuid);
    for (std::uint32_t s = 0; s < keyframes; ++s) EXPECT_TRUE(publisher->push(keyframe(publisher->session(), s)).ok());
    const publishing::PublishSummary summary = publisher->finish(steady_clock::now() + seconds(60));
    EXPECT_TRUE(summary.all_settled());
    EXPECT_EQ(summary.settled, keyframes);
    EXPECT_TRUE(summary.refused.empty());
    return summary;
  };
  EXPECT_EQ(run(40).sent, 40u);
  run(60);
  EXPECT_EQ(server_->stats().keyframes_durable, 60u);
}

TEST_F(IngestThreadsTest, LiveSourceGivesUpTheOldestAndSaysSo) {
  options_.live = true;
  const auto publisher = start_publisher();
  for (std::uint32_t s = 0; s < 100; ++s)  // nobody listens
    ASSERT_TRUE(publisher->push(keyframe(publisher->session(), s)).ok());
  EXPECT_GT(publisher->progress().gaps, 50u);
  start_daemon();
  const publishing::PublishSummary summary = publisher->finish(steady_clock::now() + seconds(60));
  EXPECT_TRUE(summary.all_settled());
  EXPECT_EQ(summary.settled, 100u);
  EXPECT_EQ(server_->stats().sequences_given_up, summary.gaps);
  EXPECT_EQ(server_->stats().keyframes_durable, 100 - summary.gaps);
}

TEST_F(IngestThreadsTest, SourceThatCanWaitIsPausedUntilInterrupted) {
  const auto publisher = start_publisher();
  std::atomic<std::uint32_t> pushed = 0;
  Status last;
  std::thread source([&] {
    for (std::uint32_t s = 0; s < 100 && last.ok(); ++s) {
      last = publisher->push(keyframe(publisher->session(), s));
      if (last.ok()) ++pushed;
    }
  });
  for (std::uint32_t before = 1; before != pushed || before == 0;) {
    before = pushed;
    std::this_thread::sleep_for(milliseconds(200));
  }
  EXPECT_LT(pushed, 60u);
  publisher->interrupt();
  source.join();
  EXPECT_EQ(last.reason(), Reason::SHUTTING_DOWN);
  const publishing::PublishSummary summary = publisher->finish(steady_clock::now() + seconds(60));  // returns at once
  EXPECT_FALSE(summary.all_settled());
  EXPECT_FALSE(summary.heard);
}

TEST_F(IngestThreadsTest, PushRefusesOtherSessionsAndWrongOrder) {
  const auto publisher = start_publisher();
  ASSERT_TRUE(publisher->push(keyframe(publisher->session(), 5)).ok());
  EXPECT_EQ(publisher->push(keyframe(publisher->session(), 5)).reason(), Reason::INVALID_ARGUMENT);
  Keyframe large = keyframe(publisher->session(), 6);
  large.picture.resize(kMaxKeyframePictureBytes + 1);
  EXPECT_EQ(publisher->push(large).reason(), Reason::BAD_SIZE);
  SessionHeader other = publisher->session();
  other.uuid.bytes.fill(1);
  EXPECT_EQ(publisher->push(keyframe(other, 6)).reason(), Reason::INVALID_ARGUMENT);
  start_daemon();
  EXPECT_TRUE(publisher->finish(steady_clock::now() + seconds(60)).all_settled());
  EXPECT_EQ(server_->stats().sequences_given_up, 5u);
}

}  // namespace
}  // namespace relmap::testing
