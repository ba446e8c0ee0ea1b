// Sessions are found past gaps in their numbers, in reads that grow with the sessions and not with the numbers.
#include "storage/maintenance/stored_sessions.h"

#include <gtest/gtest.h>

#include <vector>

#include "storage/engine/memory_engine.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {
namespace {

// Counts the keys and values that are read through it.
class CountedSnapshot : public EngineSnapshot {
 public:
  explicit CountedSnapshot(std::shared_ptr<const EngineSnapshot> snapshot) : snapshot_(std::move(snapshot)) {}
  std::uint64_t commit_number() const override { return snapshot_->commit_number(); }
  Result<std::optional<Bytes>> get(std::string_view key) const override {
    ++reads_;
    return snapshot_->get(key);
  }
  Status scan_from(std::string_view prefix, std::string_view from, const Visit& visit) const override {
    ++reads_;
    return snapshot_->scan_from(prefix, from, [&](std::string_view key, ByteSpan value) {
      ++reads_;
      return visit(key, value);
    });
  }
  int reads() const { return reads_; }

 private:
  const std::shared_ptr<const EngineSnapshot> snapshot_;
  mutable int reads_ = 0;
};

TEST(StoredSessions, GapsAmongTheirNumbersArePassedOver) {
  const std::shared_ptr<Engine> engine = make_memory_engine();
  const std::uint64_t epoch = engine->acquire().value();
  const SessionNumber restored = 1u << 20, later = restored * 5;
  std::vector<Put> puts;
  for (const SessionNumber number : {1u, 2u, 40u, restored + 3, later}) {
    Session session;
    session.number = number;
    session.header.uuid = SessionUuid::random();
    puts.push_back({keys::session(number), encode_session(session)});
  }
  // Frames without a record: among the others, behind a gap, and behind all records.
  for (const SessionNumber number : {3u, restored + 2, 2 * restored, later + 1, 2 * later})
    puts.push_back({keys::part(Part::kHot, {number, 0}), Bytes(10)});
  ASSERT_TRUE(engine->commit(epoch, 0, puts, {}).ok());

  const CountedSnapshot snapshot(engine->snapshot());
  const StoredSessions stored = load_sessions(snapshot);
  std::vector<SessionNumber> numbers;
  for (const Session& session : stored.sessions) numbers.push_back(session.number);
  EXPECT_EQ(numbers, (std::vector<SessionNumber>{1, 2, 40, restored + 3, later}));
  EXPECT_EQ(stored.unknown, (std::vector<SessionNumber>{3, restored + 2, 2 * restored, later + 1, 2 * later}));
  EXPECT_TRUE(stored.damage.empty());
  EXPECT_LT(snapshot.reads(), 1000);
}

}  // namespace
}  // namespace relmap::storage
