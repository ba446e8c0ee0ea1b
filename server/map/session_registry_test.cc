#include "server/map/session_registry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "storage/engine/memory_engine.h"
#include "storage/testing/partial_graph.h"

namespace relmap::map {
namespace {

// The map's sessions, and nothing else of it.
class SessionsOnly final : public storage::PartialGraph {
 public:
  std::shared_ptr<const storage::FrameHot> hot(FrameId) const override { return nullptr; }
  std::vector<storage::Session> all_sessions() const override { return known; }
  std::optional<storage::Session> session(SessionNumber number) const override {
    for (const storage::Session& session : known)
      if (session.number == number) return session;
    return std::nullopt;
  }
  std::vector<storage::Session> known;
};

class SessionRegistryTest : public ::testing::Test {
 protected:
  explicit SessionRegistryTest(std::size_t budget_bytes = std::size_t{64} << 20)
      : budget_(std::make_shared<storage::Budget>(budget_bytes)) {}

  static SessionHeader header(const std::string& name, const std::string& robot = "one") {
    SessionHeader header;
    header.uuid = SessionUuid::random();
    header.robot = robot;
    header.name = name;
    header.camera = {500, 320, 240, 0.1, 640, 480};
    return header;
  }

  // Makes records durable at once, or keeps them until the test lets them be.
  Status journal(storage::SessionRecord record, SessionRegistry::Durable done) {
    if (!journal_takes_.ok()) return journal_takes_;
    journalled_.push_back(std::move(record));
    const std::uint64_t sequence = journalled_.size();
    const bool waits = journal_waits_;  // once: it is set by another thread
    if (!waits) {
      done(sequence);
    } else {
      const std::lock_guard lock(waiting_mutex_);
      waiting_.emplace_back(sequence, std::move(done));
    }
    return {};
  }
  std::size_t waiting() {
    const std::lock_guard lock(waiting_mutex_);
    return waiting_.size();
  }

  const std::shared_ptr<storage::Engine> engine_ = storage::make_memory_engine();
  const std::uint64_t epoch_ = engine_->acquire().or_throw();
  const std::shared_ptr<storage::Budget> budget_;
  const std::shared_ptr<SessionsOnly> view_ = std::make_shared<SessionsOnly>();
  Status health_, journal_takes_;
  std::vector<storage::SessionRecord> journalled_;
  std::atomic<bool> journal_waits_ = false;
  std::mutex waiting_mutex_;
  std::vector<std::pair<std::uint64_t, SessionRegistry::Durable>> waiting_;
  std::optional<SessionRegistry> sessions_{std::in_place,
                                           engine_,
                                           budget_,
                                           [this] { return view_; },
                                           [this](storage::SessionRecord record, SessionRegistry::Durable done) {
                                             return journal(std::move(record), std::move(done));
                                           },
                                           [this] { return health_; }};
};

TEST_F(SessionRegistryTest, ASessionKeepsItsNumberAndIsJournalledOnce) {
  sessions_->load(epoch_, *view_);
  const SessionHeader morning = header("morning"), evening = header("evening");
  const SessionNumber first = sessions_->begin(morning).or_throw();
  const SessionNumber second = sessions_->begin(evening).or_throw();
  EXPECT_NE(first, second);
  EXPECT_EQ(first, sessions_->begin(morning).or_throw());
  ASSERT_EQ(2u, journalled_.size());
  EXPECT_EQ(first, journalled_[0].number);
  EXPECT_EQ("morning", journalled_[0].display_name);
}

TEST_F(SessionRegistryTest, WhatARobotSaysOfWhenAndByWhomIsDropped) {
  SessionHeader forged = header("morning");
  forged.unknown = {{19, {1}}, {20, {'a', 'n', 'n'}}, {1000, {1}}};
  sessions_->load(epoch_, *view_);
  ASSERT_TRUE(sessions_->begin(forged).ok());
  EXPECT_EQ(journalled_.back().header.unknown, (Extensions{{1000, {1}}}));
}

TEST_F(SessionRegistryTest, SessionsOfOneNameAreNumbered) {
  sessions_->load(epoch_, *view_);
  sessions_->begin(header("tour")).or_throw();
  sessions_->begin(header("tour")).or_throw();
  sessions_->begin(header("tour", "another robot")).or_throw();
  ASSERT_EQ(3u, journalled_.size());
  EXPECT_EQ("tour#2", journalled_[1].display_name);
  EXPECT_EQ("tour", journalled_[2].display_name);
}

// A robot that begins sessions without end keeps no other waiting.
TEST_F(SessionRegistryTest, RobotsTakeTurns) {
  sessions_->load(epoch_, *view_);
  std::unique_lock held(waiting_mutex_);  // the thread stops at the first session of the journal
  journal_waits_ = true;
  const auto begin = [&](const SessionHeader& header) {
    sessions_->begin(header, [](const Result<SessionNumber>&) {});
  };
  for (int i = 0; i < 50; ++i) begin(header("flood " + std::to_string(i), "mallory"));
  begin(header("tour", "cart"));
  held.unlock();
  while (waiting() < 51) std::this_thread::yield();
  held.lock();
  const auto tour = std::find_if(journalled_.begin(), journalled_.end(),
                                 [](const storage::SessionRecord& record) { return record.header.robot == "cart"; });
  EXPECT_LE(tour - journalled_.begin(), 2);
  for (auto& [sequence, done] : waiting_) done(sequence);
}

TEST_F(SessionRegistryTest, TheCameraOfAKnownSessionIsCompared) {
  sessions_->load(epoch_, *view_);
  SessionHeader tour = header("tour");
  sessions_->begin(tour).or_throw();
  tour.camera.f = 510;
  EXPECT_EQ(Reason::CALIBRATION_CHANGED, sessions_->begin(tour).reason());
}

TEST_F(SessionRegistryTest, ASessionThatIsBeingDeletedIsRefused) {
  storage::Session gone;
  gone.number = 7;
  gone.header = header("gone");
  gone.state = storage::SessionState::kDeleting;
  view_->known = {gone};
  sessions_->load(epoch_, *view_);
  EXPECT_EQ(Reason::SESSION_DELETED, sessions_->begin(gone.header).reason());
  health_ = Status(Reason::READ_ONLY, "the disk");
  EXPECT_EQ(Reason::SESSION_DELETED, sessions_->begin(gone.header).reason()) << "the more special reason";
}

// A damaged engine may count from the beginning again.
TEST_F(SessionRegistryTest, ANumberInUseIsNotGivenAgain) {
  view_->known.resize(3);
  for (SessionNumber i = 0; i < 3; ++i) {
    view_->known[i].number = i + 1;
    view_->known[i].header = header("known");
  }
  sessions_->load(epoch_, *view_);
  EXPECT_EQ(4u, sessions_->begin(header("new")).or_throw());
}

TEST_F(SessionRegistryTest, SessionsThatAreNotJournalledAreNeitherKnownNorCharged) {
  sessions_->load(epoch_, *view_);
  const std::size_t before = budget_->used(storage::Share::kSessions);
  journal_takes_ = Status(Reason::DISK_FULL, "no room");
  const SessionHeader tour = header("tour");
  EXPECT_EQ(Reason::DISK_FULL, sessions_->begin(tour).reason());
  EXPECT_EQ(before, budget_->used(storage::Share::kSessions));
  journal_takes_ = Status();
  EXPECT_TRUE(sessions_->begin(tour).ok());
  EXPECT_EQ("tour", journalled_.back().display_name) << "the refused one is no namesake";

  health_ = Status(Reason::READ_ONLY, "the disk");
  EXPECT_EQ(Reason::READ_ONLY, sessions_->begin(header("later")).reason());
}

// Whoever asks does not wait for the disk, not even for that of another session.
TEST_F(SessionRegistryTest, NobodyWaitsWhileSessionsAreMadeDurable) {
  sessions_->load(epoch_, *view_);
  const SessionHeader known = header("known"), slow = header("tour"), other = header("tour");
  const SessionNumber number = sessions_->begin(known).or_throw();
  journal_waits_ = true;
  std::atomic<int> answers = 0;
  std::set<SessionNumber> numbers;
  const auto answered = [&](const Result<SessionNumber>& begun) {
    EXPECT_TRUE(begun.ok()) << begun.status().to_string();
    if (begun.ok()) numbers.insert(*begun);
    ++answers;
  };
  for (const SessionHeader& session : {slow, other, slow}) sessions_->begin(session, answered);
  while (waiting() < 2) std::this_thread::yield();
  EXPECT_EQ(sessions_->begin(known).or_throw(), number);
  EXPECT_EQ(sessions_->find(known.uuid), number);
  EXPECT_EQ(sessions_->find(slow.uuid), std::nullopt) << "it is not durable yet";
  SessionHeader changed = slow;
  changed.camera.f = 510;
  EXPECT_EQ(sessions_->begin(changed).reason(), Reason::CALIBRATION_CHANGED);
  EXPECT_EQ(answers, 0);

  for (auto& [sequence, done] : waiting_) done(sequence);
  EXPECT_EQ(answers, 3);
  EXPECT_EQ(numbers.size(), 2u) << "one session was begun twice";
  EXPECT_EQ(sessions_->begin(changed).reason(), Reason::CALIBRATION_CHANGED) << "although the map does not show it yet";
  ASSERT_EQ(journalled_.size(), 3u);
  EXPECT_EQ(journalled_[2].display_name, "tour#2") << "it counts those that are beginning";
}

TEST_F(SessionRegistryTest, ThoseThatWaitAreRefusedAtTheEnd) {
  sessions_->load(epoch_, *view_);
  sessions_->stop();
  EXPECT_EQ(sessions_->begin(header("late")).reason(), Reason::SHUTTING_DOWN);
}

class CrowdedRegistryTest : public SessionRegistryTest {
 protected:
  CrowdedRegistryTest() : SessionRegistryTest(std::size_t{1} << 20) {}
};

TEST_F(CrowdedRegistryTest, ThereAreAsManySessionsAsTheBudgetAllows) {
  sessions_->load(epoch_, *view_);
  Status refused;
  for (int i = 0; i < 10'000 && refused.ok(); ++i) refused = sessions_->begin(header("s" + std::to_string(i))).status();
  EXPECT_EQ(Reason::BUDGET_EXCEEDED, refused.reason());
  EXPECT_LE(budget_->used(storage::Share::kSessions), budget_->allowance(storage::Share::kSessions));
  sessions_.reset();
  EXPECT_EQ(0u, budget_->used(storage::Share::kSessions));
}

}  // namespace
}  // namespace relmap::map
