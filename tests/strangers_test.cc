// A robot of the fleet begins sessions without end: honest robots' sessions begin meanwhile and after a restart, and
// when the strangers' are deleted, their memory and their disk space come back.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "server/ingest/mapper_sink.h"
#include "server/intake/ingest_server.h"
#include "server/map/mapper.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/patience.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using storage::Share;

const std::string kHonest = "cart", kStranger = "mallory";
// What is remembered of a session that was deleted, so that its uuid is not taken again.
constexpr std::size_t kTombstoneBytes = 128;

class StrangersTest : public ::testing::Test {
 protected:
  void open(double max_new_sessions_per_min) {
    storage::RocksDbOptions options;
    options.cache_bytes = std::size_t{32} << 20;
    options.now = [this] { return steady_clock::now() + std::chrono::hours(hours_later_); };
    map::MapperOptions map_options;
    map_options.closures = false;
    map_options.folder = folder_ / "map";
    budget_ = std::make_shared<storage::Budget>(std::size_t{512} << 20);
    mapper_ =
        map::Mapper::open(storage::open_rocksdb(folder_ / "map", options).or_throw(), budget_, nullptr, map_options)
            .or_throw();
    sink_ = std::make_unique<ingest::MapperSink>(*mapper_);
    intake::IngestServerOptions intake;
    intake.max_new_sessions_per_min = max_new_sessions_per_min;
    server_ = std::make_unique<intake::IngestServer>(*sink_, *budget_, SessionUuid::random().bytes, intake);
  }
  void close() {
    server_.reset();
    sink_.reset();
    EXPECT_TRUE(mapper_->stop().ok());
    mapper_.reset();
  }
  void TearDown() override { close(); }

  // The first keyframe of a new session, without features, which would be of keyframes before; its picture is of random
  // bytes, so that nothing makes it smaller.
  Bytes first_keyframe(const SessionUuid& session, const std::string& robot) {
    Keyframe k = sample_keyframe();
    k.session.uuid = session;
    k.session.robot = robot;
    k.session.name = "drive";
    k.sequence = 0;
    k.tracks.clear();
    k.appearance.clear();
    k.picture.assign(4000, 0);
    for (std::uint8_t& byte : k.picture) byte = static_cast<std::uint8_t>(random_());
    std::copy_n("\xff\xd8\xff", 3, k.picture.begin());
    return encode_keyframe(k);
  }
  void send(const SessionUuid& session, const std::string& robot, const Bytes& payload) {
    server_->take_payload(session, 0, crc32c(payload), payload, {robot},
                          [](const Status& taken) { EXPECT_TRUE(taken.ok()) << taken.to_string(); });
  }
  void send_stranger() {
    const SessionUuid session = SessionUuid::random();
    send(session, kStranger, first_keyframe(session, kStranger));
  }
  bool settled(const SessionUuid& session) const {
    const auto ack = server_->acknowledgement(session);
    return ack.ok() && ack->next_sequence == 1 && ack->refused.empty();
  }
  std::string refused() const {
    std::string text;
    const intake::IngestStats stats = server_->stats();
    for (std::size_t i = 0; i < stats.parts_refused.size(); ++i)
      if (const auto count = stats.parts_refused[i] + stats.keyframes_refused[i]; count > 0)
        text += std::string(reason_name(static_cast<Reason>(i))) + " " + std::to_string(count) + " ";
    return text;
  }
  // As a robot does: it sends again what was not taken.
  void expect_honest_session_to_begin() {
    const SessionUuid session = SessionUuid::random();
    const Bytes payload = first_keyframe(session, kHonest);
    const auto until = steady_clock::now() + kPatience;
    for (int tries = 0; !settled(session) && steady_clock::now() < until; ++tries) {
      if (tries % 50 == 0) send(session, kHonest, payload);
      std::this_thread::sleep_for(milliseconds(2));
    }
    ASSERT_TRUE(settled(session)) << refused();
    honest_.push_back(session);
  }

  // At least so many sessions of strangers, with some of the honest robot among them. What is not taken for want of
  // room is made up for by others.
  void let_strangers_come(std::size_t sessions) {
    constexpr std::size_t kUnderWay = 200;
    const auto durable = [this] { return server_->stats().keyframes_durable; };
    const std::size_t before = durable();
    const auto until = steady_clock::now() + 6 * kPatience;
    for (std::size_t asked = 0; durable() < before + sessions; std::this_thread::sleep_for(milliseconds(1))) {
      for (std::size_t i = 0; i < kUnderWay; ++i) send_stranger();
      const std::size_t come = durable() - before;
      if (come >= asked * sessions / 4 && asked++ < 4) expect_honest_session_to_begin();
      ASSERT_LT(steady_clock::now(), until) << come << " sessions have begun; " << refused();
    }
    settle();
  }

  void settle() const {
    ASSERT_TRUE(mapper_->wait_idle(steady_clock::now() + 10 * kPatience).ok());
    ASSERT_TRUE(mapper_->commit(steady_clock::now() + kPatience).ok());
  }

  // The numbers of the sessions of a robot that are there.
  std::vector<SessionNumber> sessions_of(const std::string& robot) const {
    std::vector<SessionNumber> all;
    for (const storage::Session& session : mapper_->view()->sessions())
      if (session.header.robot == robot && !storage::is_going(session)) all.push_back(session.number);
    return all;
  }
  void delete_sessions(const std::vector<SessionNumber>& sessions) const {
    for (const SessionNumber session : sessions) {
      const storage::SetSessionStateRecord record{session, storage::SessionState::kDeleting};
      while (mapper_->submit(record, [](const Result<std::uint64_t>&) {}).reason() == Reason::BUDGET_EXCEEDED)
        std::this_thread::sleep_for(milliseconds(1));
    }
    settle();
  }

  // What the budget counts of the map and of what comes in; caches give way by themselves.
  std::size_t memory() const {
    std::size_t sum = 0;
    for (const Share share :
         {Share::kDirty, Share::kViews, Share::kPlaceIndex, Share::kQueues, Share::kReassembly, Share::kSessions})
      sum += budget_->used(share);
    return sum;
  }
  std::size_t disk() const {
    std::size_t sum = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder_ / "map"))
      if (entry.is_regular_file()) sum += entry.file_size();
    return sum;
  }

  void comes_back(std::size_t at_least) {
    open(0);
    expect_honest_session_to_begin();
    settle();
    const std::size_t memory_before = memory(), disk_before = disk();
    let_strangers_come(at_least);
    const std::size_t in_view = sessions_of(kStranger).size();
    ASSERT_GE(in_view + honest_.size(), at_least) << refused();
    const std::size_t disk_top = disk(), memory_top = memory();
    close();
    open(0);
    expect_honest_session_to_begin();
    const std::size_t strangers = sessions_of(kStranger).size();
    EXPECT_GE(strangers, in_view);  // some may have begun since
    delete_sessions(sessions_of(kStranger));
    EXPECT_EQ(sessions_of(kStranger).size(), 0u);
    EXPECT_EQ(sessions_of(kHonest).size(), honest_.size());
    // A day later what was deleted is off the disk without anybody's doing, but for what is not worth collecting: its
    // small parts. An operator's compaction takes these, too.
    const std::size_t disk_limit = disk_before + (disk_top - disk_before) / 10;
    const auto until = steady_clock::now() + kPatience;
    for (int i = 0; disk() > disk_limit && steady_clock::now() < until; ++i) {
      if (i % 20 == 0) {  // the store looks at the clock after commits
        hours_later_ += 24;
        expect_honest_session_to_begin();
        settle();
        EXPECT_TRUE(mapper_->engine().compact([](std::uint64_t, std::uint64_t) { return Status(); }).ok());
      }
      std::this_thread::sleep_for(milliseconds(50));
    }
    std::printf("%zu strangers: memory %zu, %zu, %zu; disk %zu, %zu, %zu bytes before, with them, without\n", strangers,
                memory_before, memory_top, memory(), disk_before, disk_top, disk());
    EXPECT_LE(memory(), memory_before + kTombstoneBytes * (strangers + honest_.size()));
    EXPECT_LE(disk(), disk_limit);
    close();
    open(0);
    expect_honest_session_to_begin();
    EXPECT_EQ(sessions_of(kHonest).size(), honest_.size());
    for (const SessionUuid& session : honest_) EXPECT_TRUE(settled(session));
  }

  const storage::TemporaryFolder folder_;
  std::mt19937 random_{1};
  std::atomic<int> hours_later_ = 0;
  std::shared_ptr<storage::Budget> budget_;
  std::unique_ptr<map::Mapper> mapper_;
  std::unique_ptr<ingest::MapperSink> sink_;
  std::unique_ptr<intake::IngestServer> server_;
  std::vector<SessionUuid> honest_;
};
using LongStrangersTest = StrangersTest;

TEST_F(StrangersTest, KeepNobodyOutAndLeaveNothingWhenTheirSessionsAreDeleted) { comes_back(2000); }
TEST_F(LongStrangersTest, KeepNobodyOutAndLeaveNothingWhenTheirSessionsAreDeleted) { comes_back(100'000); }

TEST_F(StrangersTest, BeginAsManySessionsAsARobotMay) {
  open(60);
  expect_honest_session_to_begin();
  for (int i = 0; i < 2000; ++i) send_stranger();
  expect_honest_session_to_begin();
  settle();
  const std::size_t begun = sessions_of(kStranger).size();
  EXPECT_GE(begun, 60u);
  EXPECT_LE(begun, 120u) << "more than a minute's worth and what a minute of patience adds";
  EXPECT_GT(server_->stats().parts_refused[intake::index_of(Reason::RATE_LIMITED)], 1000u);
}

}  // namespace
}  // namespace relmap::testing
