// Each allocation of a commit fails in turn. The map is as it was, and the next commit writes all of it.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>

#include "storage/engine/memory_engine.h"
#include "storage/map/map.h"
#include "storage/testing/random_frames.h"

namespace {

thread_local std::uint64_t before_failure = 0;  // so many allocations of this thread succeed, less one; 0: all do

bool fails() { return before_failure > 0 && --before_failure == 0; }

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
    if (n % 2 == 0) map->publish();
    const auto before = hash_map(*map);
    failed = false;
    before_failure = n;
    try {
      const Status begun = map->begin_commit({});
      failed = !begun.ok();
    } catch (const std::bad_alloc&) {
      failed = true;
    }
    before_failure = 0;
    edit(*map);  // meanwhile
    if (const auto outcome = map->finish_commit()) {
      EXPECT_EQ(outcome->ok(), !failed);
    }
    EXPECT_NE(hash_map(*map), before);
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

}  // namespace
}  // namespace relmap::storage
