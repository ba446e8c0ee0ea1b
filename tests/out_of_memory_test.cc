// Each allocation of a commit, or of an append to the journal, fails in turn. The map is as it was, and the next commit
// writes all of it; the journal has what was acknowledged, and takes the record when it comes again.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>

#include "storage/engine/memory_engine.h"
#include "storage/io/file.h"
#include "storage/journal/journal_log.h"
#include "storage/map/map.h"
#include "storage/testing/random_frames.h"
#include "storage/testing/temporary_folder.h"

namespace {

thread_local std::uint64_t before_failure = 0;  // so many allocations of this thread succeed, less one; 0: all do
thread_local std::uint64_t allocations = 0;

bool fails() {
  ++allocations;
  return before_failure > 0 && --before_failure == 0;
}

}  // namespace

void* operator new(std::size_t size) {
  if (void* made = fails() ? nullptr : std::malloc(size)) return made;
  throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto unit = static_cast<std::size_t>(alignment);
  if (void* made = fails() ? nullptr : std::aligned_alloc(unit, (size + unit - 1) / unit * unit)) return made;
  throw std::bad_alloc();
}

// Not inlined, since compilers know that free() does not fit what operator new makes, but not that it does here.
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace relmap::storage {
namespace {

class MapOutOfMemoryTest : public ::testing::Test {
 protected:
  std::unique_ptr<Map> open() { return Map::open(engine_, epoch_, budget_).or_throw(); }
  void begin(Map& map, SessionNumber number) {
    Session session = random_.session(number);
    session.first = session.last = session.frames = 0;
    map.add_session(session);
  }
  void edit(Map& map) {
    const std::uint32_t index = frames_++;
    FrameCold cold = random_.cold();
    FrameHot hot = random_.hot({1, index});
    hot.appearance_count = static_cast<std::uint32_t>(cold.appearance.size());
    map.add_frame({1, index}, std::move(hot), random_.warm(), std::move(cold));
    Session& session = map.edit_session(1);
    session.last = index;
    session.frames = frames_;
    map.edit_hot({1, random_.below(frames_)}).mean_error = static_cast<float>(frames_);
    map.set_label({1, random_.below(frames_)}, "label " + std::to_string(index % 3), index % 5 != 0);
    map.state().pending.insert({1, random_.below(frames_)});
    map.state().pending.erase({1, random_.below(frames_)});
    map.skip(1, {100'000 + 2 * index, 100'000 + 2 * index, index, index % 2 == 0, Reason::CORRUPT});
    map.remember_edit(++edits_, {"edit " + std::to_string(edits_), edits_});
  }
  void expect_as_stored(Map& map) {
    const auto again = open();
    EXPECT_EQ(hash_map(*again), hash_map(map));
    EXPECT_TRUE(again->state().pending == map.state().pending);
    EXPECT_EQ(again->edits(), map.edits());
    for (int k = 0; k < 3; ++k) {
      const std::string label = "label " + std::to_string(k);
      EXPECT_EQ(again->labelled(label), map.labelled(label));
    }
  }

  const std::shared_ptr<Engine> engine_ = make_memory_engine();
  const std::uint64_t epoch_ = engine_->acquire().value();
  const std::shared_ptr<Budget> budget_ = std::make_shared<Budget>(std::size_t{64} << 20);
  RandomFrames random_{7};
  std::uint32_t frames_ = 0;
  std::uint64_t edits_ = 0;
};

TEST_F(MapOutOfMemoryTest, ACommitLosesNothingWhicheverAllocationFails) {
  auto map = open();
  begin(*map, 1);
  ASSERT_TRUE(map->commit().ok());
  bool failed = true;
  std::uint64_t n = 1;
  for (; failed; ++n) {
    for (int i = 0; i < 3; ++i) edit(*map);
    // What the commit publishes first, and ends the process where it cannot: nothing, and as often.
    map->publish();
    const std::uint64_t used = allocations;
    map->publish();
    const std::uint64_t published = allocations - used;
    const auto before = hash_map(*map);
    failed = false;
    before_failure = published + n;
    try {
      const Status begun = map->begin_commit({});
      failed = !begun.ok();
    } catch (const std::bad_alloc&) {
      failed = true;
    }
    before_failure = 0;
    ASSERT_EQ(hash_map(*map), before) << n;
    edit(*map);  // meanwhile
    if (const auto outcome = map->finish_commit()) {
      EXPECT_EQ(outcome->ok(), !failed);
    }
    ASSERT_TRUE(map->commit().ok()) << n;
    ASSERT_EQ(map->dirty_bytes(), 0u) << n;
    ASSERT_EQ(budget_->used(Share::kDirty), 0u) << n;
    if (n % 16 == 1) expect_as_stored(*map);
    if (HasFailure()) FAIL() << "allocation " << n;
  }
  expect_as_stored(*map);
  EXPECT_GT(n, 100u);
  std::printf("%llu allocations failed\n", static_cast<unsigned long long>(n - 2));
}

TEST(JournalOutOfMemoryTest, AnAppendIsDoneOrNotWhicheverAllocationFails) {
  const TemporaryFolder folder;
  const auto files = posix_file_system();
  const auto open = [&](bool read_only) {
    return JournalLog::open(files, folder / "journal", 0, {.segment_bytes = 300, .read_only = read_only}).or_throw();
  };
  const auto log = open(false);
  const auto record_of = [](std::uint64_t sequence) { return Bytes(100, static_cast<std::uint8_t>(sequence)); };
  const auto expect_all = [&] {
    const auto again = open(true);
    EXPECT_TRUE(again->loss().ok()) << again->loss().to_string();
    EXPECT_EQ(again->last(), log->last());
    std::uint64_t next = 1;
    EXPECT_TRUE(again
                    ->read(1,
                           [&](std::uint64_t sequence, ByteSpan record) {
                             EXPECT_EQ(sequence, next++);
                             const Bytes expected = record_of(sequence);
                             EXPECT_TRUE(std::equal(record.begin(), record.end(), expected.begin(), expected.end()))
                                 << sequence;
                             return true;
                           })
                    .ok());
    EXPECT_EQ(next, log->last() + 1);
  };
  std::uint64_t failures = 0, n = 1;
  for (bool failed = true; failed; ++n) {
    failed = false;
    // Every third record begins a segment, and so does the one after a failure, at which another allocation fails.
    for (std::uint64_t again = 1; again <= 24; ++again) {
      const std::uint64_t last = log->last();
      const Bytes record = record_of(last + 1);
      for (const std::uint64_t fails_at : {n, again, std::uint64_t{0}}) {
        if (log->last() > last) break;
        before_failure = fails_at;
        try {
          if (!log->append({&record, 1}).ok()) ++failures, failed = true;
        } catch (const std::bad_alloc&) {
          ++failures, failed = true;
        }
        before_failure = 0;
      }
      ASSERT_EQ(log->last(), last + 1) << n << " " << again;
    }
    expect_all();
    if (::testing::Test::HasFailure()) FAIL() << "allocation " << n;
  }
  EXPECT_GT(failures, 20u);
  std::printf("%llu allocations failed\n", static_cast<unsigned long long>(failures));
}

}  // namespace
}  // namespace relmap::storage
