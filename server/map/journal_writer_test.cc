#include "server/map/journal_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "storage/engine/memory_engine.h"
#include "storage/testing/forwarding_engine.h"

namespace relmap::map {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using Sizes = std::vector<std::size_t>;

// An engine whose appends the test holds up and lets fail. Thread-safe.
class HeldJournal final : public storage::ForwardingEngine {
 public:
  HeldJournal() : ForwardingEngine(storage::make_memory_engine()) {}

  Result<std::uint64_t> append(std::uint64_t epoch, std::span<const Bytes> records) override {
    std::unique_lock lock(mutex_);
    ++begun_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !held_; });
    if (throws_) throw std::runtime_error("no memory for the log");
    if (!fails_.ok()) return fails_;
    if (!records.empty()) groups_.push_back(records.size());
    return engine().append(epoch, records);
  }

  // From now on appends begin but do not end.
  void hold() {
    set([this] { held_ = true; });
  }
  void let_go() {
    set([this] { held_ = false; });
  }
  void fail(const Status& why) {
    set([this, &why] { fails_ = why; });
  }
  void throw_errors(bool throws) {
    set([this, throws] { throws_ = throws; });
  }
  // Waits until `count` appends have begun since the test began.
  void await_append(int count = 1) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, std::chrono::seconds(60), [&] { return begun_ >= count; }));
  }
  Sizes groups() {
    const std::lock_guard lock(mutex_);
    return groups_;
  }

 private:
  void set(const std::function<void()>& change) {
    const std::lock_guard lock(mutex_);
    change();
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool held_ = false, throws_ = false;
  int begun_ = 0;
  Status fails_;
  Sizes groups_;  // numbers of records of the appends that succeeded
};

storage::JournalRecord named(const std::string& label) { return storage::SetLabelRecord{{1, 0}, label, true}; }
std::string name_of(const storage::JournalRecord& record) { return std::get<storage::SetLabelRecord>(record).label; }

class JournalWriterTest : public ::testing::Test {
 protected:
  ~JournalWriterTest() override { engine_->let_go(); }  // so that a failed test ends

  void start(bool one_at_a_time = false) {
    writer_ = std::make_unique<JournalWriter>(
        engine_, epoch_, budget_, one_at_a_time,
        [this](std::vector<DurableRecord> group) {
          const std::lock_guard lock(mutex_);
          durable_groups_.push_back(group.size());
          for (const DurableRecord& record : group) {
            durable_.emplace_back(record.sequence, name_of(record.record));
            budget_->release(storage::Share::kQueues, record.bytes);
          }
        },
        [this] {
          const bool idle = writer_->idle();
          const std::lock_guard lock(mutex_);
          told_idle_ = idle;
          changed_.notify_all();
        });
  }
  // Submits a record. Every call of its callback is noted in answers_.
  Status submit(const std::string& name) {
    std::size_t index = 0;
    {
      const std::lock_guard lock(mutex_);
      index = answers_.size();
      answers_.emplace_back();
    }
    return writer_->submit(named(name), [this, index](const Result<std::uint64_t>& result) {
      const std::lock_guard lock(mutex_);
      answers_[index].push_back(result);
      order_.push_back(index);
      if (result.ok() && (durable_.empty() || durable_.back().first < *result)) ++answered_too_early_;
      changed_.notify_all();
    });
  }
  // Waits until `count` callbacks were called.
  void await_answers(std::size_t count) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(changed_.wait_for(lock, std::chrono::seconds(60), [&] { return order_.size() >= count; }));
  }
  // Asks until the writer takes records again.
  void await_health() {
    for (int i = 0; i < 60'000 && !writer_->health().ok(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_TRUE(writer_->health().ok());
  }
  // The answers of all records; a record with two answers, or none, is none of these.
  std::vector<Reason> reasons() {
    const std::lock_guard lock(mutex_);
    std::vector<Reason> reasons;
    for (const auto& answers : answers_)
      reasons.push_back(answers.size() == 1 ? answers[0].reason() : Reason::NO_SUCH_FILE);
    return reasons;
  }
  std::vector<std::uint64_t> sequences() {
    const std::lock_guard lock(mutex_);
    std::vector<std::uint64_t> sequences;
    for (const auto& answers : answers_) sequences.push_back(answers.size() == 1 && answers[0].ok() ? *answers[0] : 0);
    return sequences;
  }
  std::vector<std::string> journal() const {
    std::vector<std::string> names;
    (void)engine_->read_journal(1, [&](std::uint64_t, ByteSpan record) {
      names.push_back(name_of(storage::decode_record(record).or_throw().record));
      return true;
    });
    return names;
  }
  std::size_t queued_bytes() const { return budget_->used(storage::Share::kQueues); }

  const std::shared_ptr<HeldJournal> engine_ = std::make_shared<HeldJournal>();
  const std::uint64_t epoch_ = engine_->acquire().or_throw();
  std::shared_ptr<storage::Budget> budget_ = std::make_shared<storage::Budget>(std::size_t{64} << 20);
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::vector<Result<std::uint64_t>>> answers_;     // of each submitted record
  std::vector<std::size_t> order_;                              // of the callbacks
  std::vector<std::pair<std::uint64_t, std::string>> durable_;  // as on_durable was told
  Sizes durable_groups_;                                        // as on_durable was told
  int answered_too_early_ = 0;                                  // callbacks before on_durable
  bool told_idle_ = false;                                      // by the last call of on_idle
  std::unique_ptr<JournalWriter> writer_;
};

TEST_F(JournalWriterTest, RecordsThatQueueDuringAnAppendGoTogetherIntoTheNext) {
  engine_->hold();
  start();
  ASSERT_TRUE(submit("a").ok());
  engine_->await_append();
  for (const char* name : {"b", "c", "d"}) ASSERT_TRUE(submit(name).ok());
  EXPECT_EQ(writer_->waiting(), 4u);
  EXPECT_EQ(writer_->durable_through(), 0u);
  engine_->let_go();
  await_answers(4);
  writer_->stop();
  EXPECT_EQ(engine_->groups(), (Sizes{1, 3}));
  EXPECT_EQ(durable_groups_, (Sizes{1, 3}));
  EXPECT_THAT(journal(), ElementsAre("a", "b", "c", "d"));
  EXPECT_THAT(durable_, ElementsAre(std::pair(1, "a"), std::pair(2, "b"), std::pair(3, "c"), std::pair(4, "d")));
  EXPECT_THAT(sequences(), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(order_, ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(answered_too_early_, 0) << "the worker has a record before its sender hears of it";
  EXPECT_EQ(writer_->durable_through(), 4u);
  EXPECT_EQ(writer_->waiting(), 0u);
  EXPECT_EQ(queued_bytes(), 0u);
}

TEST_F(JournalWriterTest, ItTellsWhenItHasBecomeIdle) {
  start();
  ASSERT_TRUE(submit("a").ok());
  std::unique_lock lock(mutex_);
  EXPECT_TRUE(changed_.wait_for(lock, std::chrono::seconds(60), [&] { return told_idle_; }));
  EXPECT_EQ(order_.size(), 1u) << "after the last answer";
}

TEST_F(JournalWriterTest, EveryRecordOfManyThreadsGetsOneAnswerAndItsOwnPlace) {
  start();
  constexpr int kThreads = 4, kEach = 50;
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t)
      threads.emplace_back([this, t] {
        for (int i = 0; i < kEach; ++i) EXPECT_TRUE(submit(std::to_string(t) + ' ' + std::to_string(i)).ok());
      });
  }
  writer_->stop();
  EXPECT_THAT(reasons(), AllOf(SizeIs(kThreads * kEach), Each(Reason::OK)));
  const std::vector<std::string> names = journal();
  ASSERT_EQ(names.size(), std::size_t{kThreads * kEach});
  std::vector<int> next(kThreads);
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(durable_[i], std::pair(std::uint64_t{i + 1}, names[i]));
    const std::size_t space = names[i].find(' ');
    EXPECT_EQ(std::stoi(names[i].substr(space)), next[std::stoul(names[i])]++) << "in the order of each thread";
  }
}

TEST_F(JournalWriterTest, ARecordCarriesTheSequenceThatWasDurableWhenItWasWritten) {
  start();
  for (std::size_t i = 1; i <= 2; ++i) {
    ASSERT_TRUE(submit("a").ok());
    await_answers(i);
  }
  std::vector<std::uint64_t> acknowledged;
  (void)engine_->read_journal(1, [&](std::uint64_t, ByteSpan record) {
    acknowledged.push_back(storage::decode_record(record).or_throw().acknowledged_through);
    return true;
  });
  EXPECT_THAT(acknowledged, ElementsAre(0, 1));
}

TEST_F(JournalWriterTest, AFailedAppendIsReportedToEveryWaiterOnceAndInOrder) {
  engine_->hold();
  start();
  ASSERT_TRUE(submit("a").ok());
  engine_->await_append();
  for (const char* name : {"b", "c"}) ASSERT_TRUE(submit(name).ok());
  engine_->fail({Reason::DISK_FULL, "no space"});
  engine_->let_go();
  await_answers(3);
  EXPECT_EQ(writer_->health().reason(), Reason::DISK_FULL);
  EXPECT_EQ(submit("d").reason(), Reason::DISK_FULL) << "at once, so that it overtakes nothing";
  EXPECT_EQ(queued_bytes(), 0u);
  engine_->fail({});
  await_health();
  ASSERT_TRUE(submit("e").ok());
  await_answers(4);
  writer_->stop();
  EXPECT_THAT(reasons(),
              ElementsAre(Reason::DISK_FULL, Reason::DISK_FULL, Reason::DISK_FULL, Reason::NO_SUCH_FILE, Reason::OK));
  EXPECT_THAT(answers_[3], IsEmpty()) << "submit() has answered";
  EXPECT_THAT(order_, ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(journal(), ElementsAre("e"));
  EXPECT_THAT(durable_, ElementsAre(std::pair(1, "e")));
}

TEST_F(JournalWriterTest, AnExceptionOfTheEngineIsReportedToEveryWaiter) {
  engine_->hold();
  start();
  ASSERT_TRUE(submit("a").ok());
  engine_->await_append();
  ASSERT_TRUE(submit("b").ok());
  engine_->throw_errors(true);
  engine_->let_go();
  await_answers(2);
  EXPECT_EQ(writer_->health().to_string(), "INTERNAL: no memory for the log");
  engine_->await_append(3);  // the writer has asked twice whether the engine takes records again
  engine_->throw_errors(false);
  await_health();
  writer_->stop();
  EXPECT_THAT(reasons(), ElementsAre(Reason::INTERNAL, Reason::INTERNAL));
  EXPECT_THAT(journal(), IsEmpty());
  EXPECT_EQ(queued_bytes(), 0u);
}

TEST_F(JournalWriterTest, AnExpiredEpochIsReportedAndNothingIsWritten) {
  start();
  ASSERT_TRUE(submit("a").ok());
  await_answers(1);
  engine_->acquire().or_throw();  // by another daemon
  ASSERT_TRUE(submit("b").ok());
  await_answers(2);
  EXPECT_EQ(submit("c").reason(), Reason::STALE_OWNER);
  engine_->await_append(3);  // it has asked the engine again
  writer_->stop();
  EXPECT_EQ(writer_->health().reason(), Reason::STALE_OWNER) << "an epoch never comes back";
  EXPECT_THAT(reasons(), ElementsAre(Reason::OK, Reason::STALE_OWNER, Reason::NO_SUCH_FILE));
  EXPECT_THAT(journal(), ElementsAre("a"));
  EXPECT_THAT(durable_, ElementsAre(std::pair(1, "a")));
}

TEST_F(JournalWriterTest, AFullQueueRefusesARecordWithoutCallingItBack) {
  budget_ = std::make_shared<storage::Budget>(std::size_t{16} << 10);  // of which 1 KiB is the queue's
  engine_->hold();
  start();
  std::size_t taken = 0;
  while (submit("a").ok()) ++taken;
  EXPECT_EQ(submit("b").reason(), Reason::BUDGET_EXCEEDED);
  EXPECT_GE(taken, 1u);
  engine_->let_go();
  await_answers(taken);
  EXPECT_TRUE(submit("c").ok()) << "there is room again";
  writer_->stop();
  EXPECT_THAT(order_, SizeIs(taken + 1));
  EXPECT_THAT(journal(), SizeIs(taken + 1));
  EXPECT_EQ(queued_bytes(), 0u);
}

TEST_F(JournalWriterTest, AStopWritesWhatIsQueued) {
  engine_->hold();
  start();
  ASSERT_TRUE(submit("a").ok());
  engine_->await_append();
  ASSERT_TRUE(submit("b").ok());
  std::thread stopping([this] { writer_->stop(); });
  while (submit("late").ok()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(submit("too late").reason(), Reason::SHUTTING_DOWN);
  engine_->let_go();
  stopping.join();
  for (std::size_t i = 0; i < answers_.size() - 2; ++i) EXPECT_THAT(answers_[i], SizeIs(1)) << i;
  EXPECT_EQ(journal().size(), answers_.size() - 2) << "all but the two that submit() refused";
  EXPECT_EQ(writer_->durable_through(), answers_.size() - 2);
}

TEST_F(JournalWriterTest, AStopDuringAFailureEndsAndRefusesWhatIsQueued) {
  engine_->hold();
  start();
  ASSERT_TRUE(submit("a").ok());
  engine_->await_append();
  ASSERT_TRUE(submit("b").ok());
  engine_->fail({Reason::IO_ERROR, "unplugged"});
  std::thread stopping([this] { writer_->stop(); });
  engine_->let_go();
  stopping.join();
  EXPECT_THAT(reasons(), ElementsAre(Reason::IO_ERROR, Reason::IO_ERROR));
  EXPECT_EQ(queued_bytes(), 0u);
}

TEST_F(JournalWriterTest, InDeterministicModeARecordWaitsForWhatFollowsFromTheOneBefore) {
  engine_->hold();
  start(true);
  for (const char* name : {"a", "b", "c"}) ASSERT_TRUE(submit(name).ok());
  engine_->let_go();
  await_answers(1);
  for (std::uint64_t sequence = 1; sequence < 5; sequence += 2) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));  // time in which the next one must not be written
    EXPECT_EQ(writer_->append_follow_up(named("follows")).or_throw(), sequence + 1);
    writer_->finished(sequence + 1);
    await_answers((sequence + 3) / 2);
  }
  EXPECT_THAT(journal(), ElementsAre("a", "follows", "b", "follows", "c"));
  EXPECT_THAT(sequences(), ElementsAre(1, 3, 5));
  EXPECT_EQ(durable_groups_, (Sizes{1, 1, 1})) << "one at a time, and what follows is not handed out";
  EXPECT_EQ(writer_->durable_through(), 5u);
}

// Written now, they would precede what still follows from the record that is being applied.
TEST_F(JournalWriterTest, InDeterministicModeAStopRefusesWhatIsQueued) {
  start(true);
  ASSERT_TRUE(submit("a").ok());
  await_answers(1);
  for (const char* name : {"b", "c"}) ASSERT_TRUE(submit(name).ok());
  writer_->stop();
  EXPECT_EQ(writer_->append_follow_up(named("follows")).or_throw(), 2u) << "the worker still ends its record";
  EXPECT_THAT(reasons(), ElementsAre(Reason::OK, Reason::SHUTTING_DOWN, Reason::SHUTTING_DOWN));
  EXPECT_THAT(journal(), ElementsAre("a", "follows"));
  EXPECT_EQ(queued_bytes(), 0u);
}

TEST_F(JournalWriterTest, AFollowUpThatFailsIsAnsweredAndRefusesTheQueue) {
  start(true);
  ASSERT_TRUE(submit("a").ok());
  await_answers(1);
  ASSERT_TRUE(submit("b").ok());
  engine_->fail({Reason::IO_ERROR, "unplugged"});
  EXPECT_EQ(writer_->append_follow_up(named("follows")).reason(), Reason::IO_ERROR);
  await_answers(2);
  EXPECT_THAT(reasons(), ElementsAre(Reason::OK, Reason::IO_ERROR));
  EXPECT_EQ(submit("c").reason(), Reason::IO_ERROR);
  engine_->fail({});
  EXPECT_EQ(writer_->append_follow_up(named("follows")).or_throw(), 2u);
  EXPECT_TRUE(writer_->health().ok()) << "an append that succeeds is an answer, too";
  EXPECT_THAT(journal(), ElementsAre("a", "follows"));
}

}  // namespace
}  // namespace relmap::map
