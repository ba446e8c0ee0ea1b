#include "frontend/capture/dc1394/frame_ring.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <thread>
#include <vector>

namespace relmap::iidc::dc1394 {
namespace {

std::shared_ptr<FrameRing> other_end(const FrameRing& ring) {
  auto mapped = FrameRing::map(FileHandle(::fcntl(ring.file(), F_DUPFD_CLOEXEC, 0)), ring.slots(), ring.frame_bytes());
  EXPECT_TRUE(mapped.ok()) << mapped.status().to_string();
  return std::move(*mapped);
}

TEST(Iidc1394FrameRing, ASlotIsTakenUntilItsLastUserIsDone) {
  const auto ring = FrameRing::make(3, 1000).or_throw();
  const auto filler = other_end(*ring);
  for (std::uint32_t i = 0; i < 3; ++i) {
    ASSERT_EQ(i, filler->take());
    std::memset(filler->slot(i), static_cast<int>('a' + i), 1000);
  }
  EXPECT_FALSE(filler->take());
  auto frame = ring->lend(1);
  ASSERT_TRUE(frame);
  EXPECT_EQ('b', frame.get()[0]);
  EXPECT_EQ('b', frame.get()[999]);
  const auto copy = frame;
  frame.reset();
  EXPECT_FALSE(filler->take());
}

TEST(Iidc1394FrameRing, SlotsComeBackInAnyOrder) {
  const auto ring = FrameRing::make(3, 10).or_throw();
  const auto filler = other_end(*ring);
  std::vector<std::shared_ptr<const std::uint8_t>> frames;
  for (std::uint32_t i = 0; i < 3; ++i) frames.push_back(ring->lend(*filler->take()));
  EXPECT_TRUE(ring->all_lent());
  frames[1].reset();
  EXPECT_FALSE(ring->all_lent());
  EXPECT_EQ(1u, filler->take());
  EXPECT_FALSE(filler->take());
}

TEST(Iidc1394FrameRing, ASlotThatIsLentOrDoesNotExistIsNotLent) {
  const auto ring = FrameRing::make(3, 10).or_throw();
  EXPECT_FALSE(ring->lend(3));
  EXPECT_FALSE(ring->lend(0xffff'ffff));
  const auto frame = ring->lend(0);
  EXPECT_TRUE(frame);
  EXPECT_FALSE(ring->lend(0));
}

TEST(Iidc1394FrameRing, FramesOutliveTheRingAndTheOtherEnd) {
  auto ring = FrameRing::make(2, 5000).or_throw();
  auto filler = other_end(*ring);
  std::memset(filler->slot(*filler->take()), 7, 5000);
  auto frame = ring->lend(0);
  ring.reset();
  filler.reset();
  EXPECT_EQ(7, frame.get()[4999]);
}

TEST(Iidc1394FrameRing, NobodyChangesItsSize) {
  const auto ring = FrameRing::make(2, 5000).or_throw();
  EXPECT_NE(0, ::ftruncate(ring->file(), 4096));
  EXPECT_NE(0, ::ftruncate(ring->file(), 1 << 20));
}

TEST(Iidc1394FrameRing, AbsurdSizesAreRefused) {
  EXPECT_EQ(Reason::INVALID_ARGUMENT, FrameRing::make(0, 10).reason());
  EXPECT_EQ(Reason::INVALID_ARGUMENT, FrameRing::make(3, 0).reason());
  EXPECT_EQ(Reason::INVALID_ARGUMENT, FrameRing::make(257, 10).reason());
  EXPECT_EQ(Reason::INVALID_ARGUMENT, FrameRing::make(3, ~std::size_t{0}).reason());
  const auto ring = FrameRing::make(2, 5000).or_throw();
  EXPECT_EQ(Reason::INVALID_ARGUMENT,
            FrameRing::map(FileHandle(::fcntl(ring->file(), F_DUPFD_CLOEXEC, 0)), 3, 5000).reason());
  EXPECT_EQ(Reason::INVALID_ARGUMENT, FrameRing::map(FileHandle(), 3, 5000).reason());
}

TEST(Iidc1394FrameRing, TwoThreadsPassFramesWithoutMixingThem) {
  const auto ring = FrameRing::make(4, 4096).or_throw();
  const auto filler = other_end(*ring);
  std::atomic<int> told = -1;
  std::thread fill([&] {
    for (int number = 0; number < 2000; ++number) {
      std::optional<std::uint32_t> slot;
      while (!(slot = filler->take())) std::this_thread::yield();
      std::memset(filler->slot(*slot), number & 0xff, 4096);
      while (told >= 0) std::this_thread::yield();
      told = static_cast<int>(*slot);
    }
  });
  for (int number = 0; number < 2000; ++number) {
    while (told < 0) std::this_thread::yield();
    const auto frame = ring->lend(static_cast<std::uint32_t>(told.load()));
    told = -1;
    ASSERT_TRUE(frame);
    EXPECT_EQ(number & 0xff, frame.get()[0]);
    EXPECT_EQ(number & 0xff, frame.get()[4095]);
  }
  fill.join();
}

}  // namespace
}  // namespace relmap::iidc::dc1394
