// Forgeries over real LCM: a robot publishes its keyframes, sealed, while an attacker on the same group sends in the
// robot's and the daemon's name whatever it can make of what it hears. Nothing of that may be believed.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <unordered_set>
#include <utility>
#include <variant>
#include <vector>

#include "frontend/publishing/lcm/lcm_transport.h"
#include "frontend/publishing/publisher.h"
#include "proto/base/clock.h"
#include "proto/base/crc32c.h"
#include "proto/base/hex.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_link.h"
#include "proto/wire/lcm_messages.h"
#include "server/ingest/lcm_ingest.h"
#include "server/intake/testing/fake_sink.h"
#include "tests/support/patience.h"
#include "tests/support/running_daemon.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr const char* kChannels[] = {kKeyframeChannel, kGapChannel,  kEndChannel, kHelloChannel,
                                     kAckChannel,      kPoseChannel, kMapChannel};

// Hears everything and knows no key, or only its own.
class Attacker {
 public:
  Attacker(const std::string& url, const SessionUuid& session, std::uint64_t seed) : session_(session), random_(seed) {
    LcmLink::Handlers handlers;
    for (const char* channel : kChannels)
      handlers.emplace_back(channel, [this, channel](ByteSpan datagram) { record(channel, datagram); });
    link_ = LcmLink::open(url, std::move(handlers)).or_throw();
  }
  ~Attacker() { link_->stop(); }

  // A robot of the fleet that turned against the others: what it sends is sealed by its own key, too.
  void use(const access::RobotKey& own) { own_.emplace(own, 1); }

  void attack(std::size_t messages) {
    for (std::size_t i = 0; i < messages; ++i) {
      forge();
      if (i % 200 == 199) std::this_thread::sleep_for(milliseconds(1));  // LCM's queues hold a thousand messages
    }
  }

  std::size_t heard() const {
    const std::lock_guard lock(mutex_);
    return heard_.size();
  }

 private:
  struct Heard {
    const char* channel;
    Bytes datagram;
  };

  void record(const char* channel, ByteSpan datagram) {
    const std::lock_guard lock(mutex_);
    if (own_ && std::string_view(channel) == kMapChannel) meet(datagram);
    if (const auto own = sent_.find(crc32c(datagram)); own != sent_.end()) {  // LCM hears what it sends itself
      sent_.erase(own);
      return;
    }
    Heard heard{channel, {datagram.begin(), datagram.end()}};
    if (heard_.size() < kKept)
      heard_.push_back(std::move(heard));
    else
      heard_[random_() % kKept] = std::move(heard);
  }

  // Is welcomed by the daemon, as any robot of the fleet.
  void meet(ByteSpan datagram) {
    const auto opened = own_->open(kMapChannel, datagram);
    const auto daemon = opened ? decode_lcm_map(opened->message) : Result<DaemonIdentity>(Reason::CORRUPT, "");
    if (daemon.ok() && own_->heard(daemon->boot, opened->seal, steady_clock::now()))
      (void)own_->welcome(*daemon, steady_clock::now());
  }

  void publish(const char* channel, const Bytes& datagram) {
    {
      const std::lock_guard lock(mutex_);
      sent_.insert(crc32c(datagram));
    }
    link_->publish(channel, datagram);
  }

  std::uint32_t some() { return static_cast<std::uint32_t>(random_()); }

  // What it heard last of a channel, or of any.
  Heard heard_of(const char* channel) {
    const std::lock_guard lock(mutex_);
    for (int tries = 0; !heard_.empty() && tries < 50; ++tries)
      if (const Heard& one = heard_[random_() % heard_.size()]; !channel || one.channel == std::string_view(channel))
        return one;
    return {channel ? channel : kGapChannel, Bytes(access::kSealBytes)};
  }

  // Sends the message without a seal, with one of another message, with a damaged one, or with its own.
  void send(const char* channel, Bytes message) {
    const Heard other = heard_of(random_() % 2 ? channel : nullptr);
    switch (random_() % 4) {
      case 0:
        break;
      case 3: {
        const std::lock_guard lock(mutex_);
        if (own_ && own_->ready(steady_clock::now())) {
          own_->seal(channel, message);
          break;
        }
        [[fallthrough]];
      }
      default:
        message.insert(message.end(), other.datagram.end() - access::kSealBytes, other.datagram.end());
        if (random_() % 2) message.back() ^= static_cast<std::uint8_t>(1 + random_() % 255);
    }
    publish(channel, message);
  }

  Keyframe forged_keyframe(std::uint32_t sequence) {
    Keyframe k = sample_keyframe();
    k.session.uuid = session_;
    k.sequence = sequence;
    k.time_us = now_us() + 3'000'000'000'000'000;  // in a century
    k.tracks.clear();
    return k;
  }

  void forge() {
    switch (random_() % 9) {
      case 0:
        return send(kGapChannel, encode_lcm(Gap{session_, some() % 50, some() % 400 + 50, Reason::DROPPED_BY_ROBOT}));
      case 1:
        return send(kEndChannel, encode_lcm(SessionEnd{session_, some() % 400}));
      case 2: {  // whole keyframes
        const std::uint32_t sequence = some() % 400;
        const Bytes payload = encode_keyframe(forged_keyframe(sequence));
        return send(kKeyframeChannel, encode_lcm(cut_part(session_, sequence, payload, crc32c(payload), 60000, 0)));
      }
      case 3: {  // garbage under a right envelope
        const Heard part = heard_of(kKeyframeChannel);
        if (part.datagram.size() <= access::kSealBytes) return;
        const auto message = ByteSpan(part.datagram).first(part.datagram.size() - access::kSealBytes);
        auto changed = decode_lcm_part(message);
        if (!changed.ok() || changed->data.empty()) return;
        changed->data[random_() % changed->data.size()] ^= 1;
        changed->part_crc = part_checksum(*changed);
        return send(kKeyframeChannel, encode_lcm(*changed));
      }
      case 4: {  // an acknowledgement that settles everything, or forgets everything
        Acknowledgement ack;
        ack.session = session_;
        ack.boot = boot();
        ack.next_sequence = random_() % 2 ? 0 : std::uint64_t{1} << 32;
        ack.credits = some() % 2 ? 0 : 64;
        if (random_() % 2) ack.refused.push_back({kWholeSession, 0, Reason::SESSION_DELETED});
        return send(kAckChannel, encode_lcm(ack));
      }
      case 5: {
        PoseNews news;
        news.session = session_;
        news.boot = boot();
        news.kind = random_() % 2 ? PoseNews::Kind::kEnded : PoseNews::Kind::kSlowDown;
        news.rate_hz = 0.1;
        return send(kPoseChannel, encode_lcm(news));
      }
      case 6: {
        DaemonIdentity other{boot(), {}};
        other.map.uuid = SessionUuid::random();
        return send(kMapChannel, encode_lcm(other));
      }
      case 7:
        return send(kHelloChannel, encode_lcm(Hello{session_}));
      default: {  // again, as it was heard, or on another channel
        const Heard again = heard_of(nullptr);
        publish(random_() % 4 ? again.channel : kChannels[random_() % std::size(kChannels)], again.datagram);
      }
    }
  }

  // Of the daemon, which tells it to everybody.
  BootId boot() {
    const Heard map = heard_of(kMapChannel);
    const auto daemon = decode_lcm_map(map.datagram);
    return daemon.ok() ? daemon->boot : BootId{};
  }

  static constexpr std::size_t kKept = 4000;
  const SessionUuid session_;
  mutable std::mutex mutex_;
  std::mt19937_64 random_;
  std::vector<Heard> heard_;
  std::optional<publishing::SealedDaemon> own_;
  std::unordered_multiset<std::uint32_t> sent_;  // checksums of what it has sent and not heard yet
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

  // Publishes `count` keyframes with two restarts of the daemon on the way, and the attack as long as that takes.
  void run(std::size_t messages, std::uint32_t count, bool insider) {
    header_ = sample_keyframe().session;
    header_.robot = "cart";
    header_.uuid = SessionUuid::random();
    start_daemon();
    publishing::PublisherOptions options;
    options.spool = (folder_ / "spool").string();
    auto transport = publishing::LcmTransport::open(url_, {cart_}).or_throw();
    const auto publisher = publishing::Publisher::start(options, header_, std::move(transport)).or_throw();
    std::mutex mutex;
    std::vector<PoseNews> news;
    publisher->hear([&](const PoseNews& one) {
      const std::lock_guard lock(mutex);
      news.push_back(one);
    });
    Attacker attacker(url_, header_.uuid, 1);
    if (insider) attacker.use(thief_);
    std::atomic<bool> attacked = false;
    std::thread attack([&] {
      attacker.attack(messages);
      attacked = true;
    });
    for (std::uint32_t s = 0; s < count; ++s) {
      EXPECT_TRUE(publisher->push(keyframe(s)).ok());
      if (s % (count / 3) != count / 6) {
        std::this_thread::sleep_for(milliseconds(2));
        continue;
      }
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
      std::this_thread::sleep_for(milliseconds(300));
      EXPECT_GE(publisher->progress().unsettled, unsettled + 5) << "a forged acknowledgement has emptied the spool";
      start_daemon();
    }
    const publishing::PublishSummary summary = publisher->finish(steady_clock::now() + kPatience);
    EXPECT_TRUE(summary.all_settled()) << summary.unsettled << " are not settled; " << publisher->trouble().to_string()
                                       << "; the daemon has refused" << refused_by_daemon();
    while (!attacked) std::this_thread::sleep_for(milliseconds(10));
    attack.join();
    EXPECT_TRUE(publisher->end_session(steady_clock::now() + kPatience));
    EXPECT_EQ(summary.settled, count);
    EXPECT_EQ(summary.gaps, 0u);
    EXPECT_TRUE(summary.refused.empty());
    EXPECT_TRUE(summary.session.ok()) << summary.session.to_string();
    EXPECT_GT(attacker.heard(), 100u) << "the attacker heard nothing that it could use";
    publisher->hear({});
    for (const PoseNews& one : news) EXPECT_NE(one.kind, PoseNews::Kind::kSlowDown);
    kill_daemon();
    check_journal(count);
  }

  std::string refused_by_daemon() const {
    std::string text;
    const intake::IngestStats stats = server_->stats();
    for (std::size_t i = 0; i < stats.messages_refused.size(); ++i)
      if (const auto count = stats.messages_refused[i] + stats.parts_refused[i]; count > 0)
        text += " " + std::string(reason_name(static_cast<Reason>(i))) + " " + std::to_string(count);
    return text;
  }

  // What was published, as it was published, once, and one end.
  void check_journal(std::uint32_t count) const {
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
    EXPECT_EQ(ends, 1u);
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
  std::unique_ptr<intake::IngestServer> server_;
  std::unique_ptr<ingest::LcmIngest> ingest_;
};
using LongLcmForgery = LcmForgery;

TEST_F(LcmForgery, NothingThatAStrangerSendsIsBelieved) { run(100'000, 300, false); }
TEST_F(LcmForgery, NothingThatAnotherRobotSendsIsBelieved) { run(30'000, 300, true); }
TEST_F(LongLcmForgery, NothingThatAStrangerSendsIsBelieved) { run(1'000'000, 3000, false); }
TEST_F(LongLcmForgery, NothingThatAnotherRobotSendsIsBelieved) { run(300'000, 3000, true); }

}  // namespace
}  // namespace relmap::testing
