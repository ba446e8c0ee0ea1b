// What every engine must do (storage/engine/engine.h). Included by one test of each engine, which instantiates it:
//   INSTANTIATE_TEST_SUITE_P(Memory, EngineConformance, ::testing::Values(...));
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "storage/engine/engine.h"

namespace relmap::storage {

// A store that can be opened again and again. An engine that keeps nothing beyond its own life has reopens == false.
struct EngineStore {
  std::function<std::shared_ptr<Engine>()> open;
  bool reopens = true;
};
struct EngineKind {
  std::string name;
  std::function<EngineStore()> create;  // a new, empty store
};
inline void PrintTo(const EngineKind& kind, std::ostream* out) { *out << kind.name; }

class EngineConformance : public ::testing::TestWithParam<EngineKind> {
 protected:
  void SetUp() override {
    store = GetParam().create();
    engine = store.open();
    ASSERT_TRUE(engine);
    epoch = engine->acquire().value();
  }

  static Bytes bytes(std::string_view text) { return {text.begin(), text.end()}; }
  std::uint64_t append(std::vector<Bytes> records) { return engine->append(epoch, records).value(); }
  std::vector<std::pair<std::uint64_t, std::string>> journal(std::uint64_t from) const {
    std::vector<std::pair<std::uint64_t, std::string>> records;
    const Status status = engine->read_journal(from, [&](std::uint64_t sequence, ByteSpan record) {
      records.emplace_back(sequence, std::string(record.begin(), record.end()));
      return true;
    });
    EXPECT_TRUE(status.ok()) << status.to_string();
    return records;
  }
  Status commit(std::uint64_t applied, std::vector<Put> puts, std::vector<std::string> deletes = {}) {
    return engine->commit(epoch, applied, puts, deletes);
  }
  static std::string get(const EngineSnapshot& snapshot, std::string_view key) {
    const auto value = snapshot.get(key).value();
    return value ? std::string(value->begin(), value->end()) : "(none)";
  }
  static std::string scan(const EngineSnapshot& snapshot, std::string_view prefix) {
    std::string all;
    EXPECT_TRUE(snapshot
                    .scan(prefix,
                          [&](std::string_view key, ByteSpan value) {
                            all += std::string(key) + "=" + std::string(value.begin(), value.end()) + ";";
                            return true;
                          })
                    .ok());
    return all;
  }
  static EngineProgress patient() {
    return [](std::uint64_t, std::uint64_t) { return Status(); };
  }
  void reopen() {
    engine.reset();
    engine = store.open();
    ASSERT_TRUE(engine);
    epoch = engine->acquire().value();
  }

  EngineStore store;
  std::shared_ptr<Engine> engine;
  std::uint64_t epoch = 0;
};

TEST_P(EngineConformance, NumbersJournalRecordsFromOneWithoutGaps) {
  EXPECT_EQ(engine->last_journal_sequence(), 0u);
  EXPECT_EQ(engine->first_journal_sequence(), 1u);
  EXPECT_EQ(append({bytes("a"), bytes("b")}), 2u);
  EXPECT_EQ(append({bytes("")}), 3u);
  EXPECT_EQ(engine->last_journal_sequence(), 3u);
  using Records = std::vector<std::pair<std::uint64_t, std::string>>;
  EXPECT_EQ(journal(1), (Records{{1, "a"}, {2, "b"}, {3, ""}}));
  EXPECT_EQ(journal(3), (Records{{3, ""}}));
  EXPECT_EQ(journal(4), Records{});
}

TEST_P(EngineConformance, StopsReadingTheJournalWhenToldTo) {
  append({bytes("a"), bytes("b"), bytes("c")});
  int visited = 0;
  EXPECT_TRUE(engine->read_journal(1, [&](std::uint64_t, ByteSpan) { return ++visited < 2; }).ok());
  EXPECT_EQ(visited, 2);
}

TEST_P(EngineConformance, TrimmedRecordsAreGoneAndNumbersGoOn) {
  append({bytes("a"), bytes("b"), bytes("c")});
  ASSERT_TRUE(commit(2, {}).ok());
  ASSERT_TRUE(engine->trim(2).ok());
  EXPECT_EQ(engine->first_journal_sequence(), 3u);
  EXPECT_EQ(journal(1).size(), 1u);
  ASSERT_TRUE(commit(3, {}).ok());
  ASSERT_TRUE(engine->trim(3).ok());
  EXPECT_EQ(engine->first_journal_sequence(), 4u);
  EXPECT_EQ(engine->last_journal_sequence(), 3u);
  EXPECT_TRUE(journal(1).empty());
  EXPECT_EQ(append({bytes("d")}), 4u);
}

TEST_P(EngineConformance, ManyLargeRecordsComeBackInOrderWhileOldOnesAreTrimmed) {
  for (std::uint64_t i = 1; i <= 60; ++i) {
    ASSERT_EQ(append({Bytes(3000, static_cast<std::uint8_t>(i))}), i);
    if (i % 20 == 0) {
      ASSERT_TRUE(commit(i - 5, {}).ok());
      ASSERT_TRUE(engine->trim(i - 5).ok());
    }
  }
  const auto records = journal(1);
  ASSERT_EQ(records.size(), 5u);
  for (std::size_t i = 0; i < records.size(); ++i) {
    EXPECT_EQ(records[i].first, 56 + i);
    EXPECT_EQ(records[i].second, std::string(3000, static_cast<char>(56 + i)));
  }
}

TEST_P(EngineConformance, ACommitShowsPutsAndDeletesTogether) {
  ASSERT_TRUE(commit(0, {{"a1", bytes("x")}, {"a2", bytes("y")}, {"b", bytes("z")}}).ok());
  ASSERT_TRUE(commit(0, {{"a2", bytes("Y")}, {"a3", {}}}, {"a1", "never there"}).ok());
  const auto snapshot = engine->snapshot();
  EXPECT_EQ(get(*snapshot, "a1"), "(none)");
  EXPECT_EQ(get(*snapshot, "a2"), "Y");
  EXPECT_EQ(get(*snapshot, "a3"), "");
  EXPECT_EQ(scan(*snapshot, "a"), "a2=Y;a3=;");
  EXPECT_EQ(scan(*snapshot, ""), "a2=Y;a3=;b=z;");
  EXPECT_EQ(scan(*snapshot, "c"), "");
}

TEST_P(EngineConformance, AScanBeginsWhereItIsTold) {
  ASSERT_TRUE(commit(0, {{"a1", bytes("x")}, {"a3", bytes("y")}, {"a5", bytes("z")}, {"b", {}}}).ok());
  const auto scanned = [&](std::string_view prefix, std::string_view from) {
    std::string keys;
    const auto visit = [&](std::string_view key, ByteSpan) { return keys.append(key).append(";"), true; };
    EXPECT_TRUE(engine->snapshot()->scan_from(prefix, from, visit).ok());
    return keys;
  };
  EXPECT_EQ(scanned("a", "a"), "a1;a3;a5;");
  EXPECT_EQ(scanned("a", "a2"), "a3;a5;");
  EXPECT_EQ(scanned("a", "a5"), "a5;");
  EXPECT_EQ(scanned("a", "a6"), "");
  EXPECT_EQ(scanned("", "a4"), "a5;b;");
}

TEST_P(EngineConformance, KeysAreBytesInUnsignedOrder) {
  const std::string low("k\0\1", 3), high("k\xff", 2), mid("k\x7f", 2);
  ASSERT_TRUE(commit(0, {{high, bytes("h")}, {low, bytes("l")}, {mid, bytes("m")}, {"l", bytes("n")}}).ok());
  std::string order;
  ASSERT_TRUE(engine->snapshot()
                  ->scan("k",
                         [&](std::string_view, ByteSpan value) {
                           order.push_back(static_cast<char>(value[0]));
                           return true;
                         })
                  .ok());
  EXPECT_EQ(order, "lmh");
}

TEST_P(EngineConformance, ASnapshotStaysAsItWas) {
  ASSERT_TRUE(commit(0, {{"k", bytes("1")}}).ok());
  const auto first = engine->snapshot();
  const std::uint64_t number = first->commit_number();
  ASSERT_TRUE(commit(0, {{"k", bytes("2")}, {"l", bytes("3")}}).ok());
  EXPECT_EQ(get(*first, "k"), "1");
  EXPECT_EQ(scan(*first, ""), "k=1;");
  EXPECT_EQ(first->commit_number(), number);
  EXPECT_EQ(engine->snapshot()->commit_number(), number + 1);
  EXPECT_EQ(get(*engine->snapshot(), "k"), "2");
}

TEST_P(EngineConformance, CommittingTheSameAgainChangesNothing) {
  append({bytes("a")});
  ASSERT_TRUE(commit(1, {{"k", bytes("1")}}, {"l"}).ok());
  ASSERT_TRUE(commit(1, {{"k", bytes("1")}}, {"l"}).ok());
  EXPECT_EQ(scan(*engine->snapshot(), ""), "k=1;");
  EXPECT_EQ(engine->applied_sequence(), 1u);
}

TEST_P(EngineConformance, RefusesToGoBackBehindWhatIsApplied) {
  append({bytes("a"), bytes("b")});
  ASSERT_TRUE(commit(2, {{"k", bytes("1")}}).ok());
  EXPECT_EQ(commit(1, {{"k", bytes("0")}}).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(get(*engine->snapshot(), "k"), "1");
}

TEST_P(EngineConformance, AnOlderOwnerIsRefused) {
  const std::uint64_t newer = engine->acquire().value();
  EXPECT_GT(newer, epoch);
  const std::vector<Bytes> records{bytes("a")};
  EXPECT_EQ(engine->append(epoch, records).reason(), Reason::STALE_OWNER);
  EXPECT_EQ(commit(0, {{"k", bytes("1")}}).reason(), Reason::STALE_OWNER);
  EXPECT_EQ(engine->allocate_session(epoch).reason(), Reason::STALE_OWNER);
  EXPECT_EQ(engine->last_journal_sequence(), 0u);
  EXPECT_EQ(scan(*engine->snapshot(), ""), "");
  EXPECT_TRUE(engine->append(newer, records).ok());
}

TEST_P(EngineConformance, NoAppendOfAnOlderOwnerCountsAfterTheNewerBegan) {
  for (int round = 0; round < 20; ++round) {
    std::atomic<bool> began{false};
    std::thread older([&, own = epoch] {
      const std::vector<Bytes> records{Bytes(2000, 1)};
      while (engine->append(own, records).ok()) began = true;
    });
    while (!began) std::this_thread::yield();
    epoch = engine->acquire().value();
    const std::uint64_t last = engine->last_journal_sequence();
    older.join();
    EXPECT_EQ(engine->last_journal_sequence(), last);
  }
}

TEST_P(EngineConformance, SessionNumbersAreNeverGivenTwice) {
  EXPECT_EQ(engine->allocate_session(epoch).value(), 1u);
  EXPECT_EQ(engine->allocate_session(epoch).value(), 2u);
  if (!store.reopens) return;
  reopen();
  EXPECT_EQ(engine->allocate_session(epoch).value(), 3u);
  EXPECT_EQ(engine->allocate_session(epoch, 10).value(), 14u);
  EXPECT_EQ(engine->allocate_session(epoch, ~SessionNumber{0}).reason(), Reason::BUDGET_EXCEEDED);
  EXPECT_EQ(engine->allocate_session(epoch, ~SessionNumber{0} - 15).value(), ~SessionNumber{0});
  EXPECT_EQ(engine->allocate_session(epoch).reason(), Reason::BUDGET_EXCEEDED);
}

TEST_P(EngineConformance, EverythingIsThereAfterReopening) {
  append({bytes("a"), bytes("b"), bytes("c")});
  ASSERT_TRUE(commit(1, {{"k", bytes("1")}, {"big", Bytes(100000, 7)}}).ok());
  if (!store.reopens) return;
  const std::uint64_t number = engine->snapshot()->commit_number();
  const std::uint64_t old_epoch = epoch;
  reopen();
  EXPECT_GT(epoch, old_epoch);
  EXPECT_EQ(engine->applied_sequence(), 1u);
  EXPECT_EQ(engine->last_journal_sequence(), 3u);
  EXPECT_EQ(engine->snapshot()->commit_number(), number);
  EXPECT_EQ(get(*engine->snapshot(), "k"), "1");
  EXPECT_EQ(engine->snapshot()->get("big").value(), Bytes(100000, 7));
  const auto records = journal(2);
  ASSERT_EQ(records.size(), 2u);
  EXPECT_EQ(records[1].second, "c");
  EXPECT_EQ(append({bytes("d")}), 4u);
}

TEST_P(EngineConformance, StatsSayWhatIsKept) {
  append({Bytes(20000, 1), Bytes(20000, 2), Bytes(20000, 3)});
  ASSERT_TRUE(commit(2, {{"k", Bytes(100000, 7)}}).ok());
  const EngineStats before = engine->stats().value();
  EXPECT_EQ(before.journal_records, 3u);
  EXPECT_GE(before.journal_bytes, 60000u);
  EXPECT_LT(before.journal_bytes, 70000u);
  EXPECT_GE(before.map_bytes, 100000u);
  EXPECT_EQ(before.dropped, "");
  ASSERT_TRUE(engine->trim(2).ok());
  EXPECT_EQ(engine->stats().value().journal_records, 1u);
}

TEST_P(EngineConformance, CompactionChangesNoAnswer) {
  for (int i = 0; i < 5; ++i)
    ASSERT_TRUE(commit(0, {{"big", Bytes(50000, static_cast<std::uint8_t>(i))}, {"gone", bytes("x")}}).ok());
  const auto held = engine->snapshot();
  ASSERT_TRUE(commit(0, {{"k", bytes("1")}}, {"gone"}).ok());
  const Status compacted = engine->compact(patient());
  ASSERT_TRUE(compacted.ok()) << compacted.to_string();
  EXPECT_EQ(get(*engine->snapshot(), "gone"), "(none)");
  EXPECT_EQ(get(*engine->snapshot(), "k"), "1");
  EXPECT_EQ(engine->snapshot()->get("big").value(), Bytes(50000, 4));
  EXPECT_EQ(get(*held, "gone"), "x");
  EXPECT_EQ(get(*held, "k"), "(none)");
  EXPECT_EQ(held->get("big").value(), Bytes(50000, 4));
}

TEST_P(EngineConformance, ReadersAndCommitsDoNotDisturbEachOther) {
  ASSERT_TRUE(commit(0, {{"a", bytes("0")}, {"b", bytes("0")}}).ok());
  std::atomic<bool> done{false};
  std::thread reader([&] {
    while (!done) {
      const auto snapshot = engine->snapshot();
      EXPECT_EQ(get(*snapshot, "a"), get(*snapshot, "b"));
    }
  });
  for (int i = 1; i <= 50; ++i) {
    const Bytes value = bytes(std::to_string(i));
    EXPECT_TRUE(commit(0, {{"a", value}, {"b", value}}).ok());
  }
  done = true;
  reader.join();
}

}  // namespace relmap::storage
