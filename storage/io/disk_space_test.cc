#include "storage/io/disk_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "storage/testing/faulty_files.h"
#include "storage/testing/forgetful_files.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::storage {
namespace {

using ::testing::HasSubstr;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

struct DiskSpaceTest : ::testing::Test {
  std::shared_ptr<ForgetfulFiles> disk = ForgetfulFiles::create(1);
  std::shared_ptr<DiskFaults> faults = std::make_shared<DiskFaults>();
  DiskSpaceOptions options{100 * kMiB, 20 * kMiB, std::chrono::milliseconds(0), std::chrono::milliseconds(0)};

  DiskSpace open() { return DiskSpace(faulty_files(disk, faults), "d", options); }
  bool reserved() const { return disk->open_read("d/RESERVE").ok(); }
};

TEST_F(DiskSpaceTest, ReportsDiskFullBelowTheMarkUntilAQuarterMoreIsFree) {
  DiskSpace space = open();
  EXPECT_TRUE(space.check().ok());
  faults->free = 99 * kMiB;
  const Status full = space.check();
  EXPECT_EQ(full.reason(), Reason::DISK_FULL);
  EXPECT_THAT(full.message(), HasSubstr("99 MiB"));
  faults->free = 124 * kMiB;
  EXPECT_EQ(space.check().reason(), Reason::DISK_FULL);
  faults->free = 125 * kMiB;
  EXPECT_TRUE(space.check().ok());
}

TEST_F(DiskSpaceTest, GivesTheReserveUpOnceAndMakesItAgainBeforeGoingOn) {
  DiskSpace space = open();
  EXPECT_TRUE(reserved());
  faults->free = 0;
  EXPECT_TRUE(space.give_up_reserve());
  EXPECT_FALSE(reserved());
  EXPECT_FALSE(space.give_up_reserve());
  faults->free = 130 * kMiB;  // enough above the mark, but not for the reserve too
  EXPECT_EQ(space.check().reason(), Reason::DISK_FULL);
  EXPECT_FALSE(reserved());
  faults->free = 145 * kMiB;
  EXPECT_TRUE(space.check().ok());
  EXPECT_TRUE(reserved());
}

// As a power failure leaves it.
TEST(DiskSpace, AReserveThatLacksItsRoomIsMadeAgain) {
  const TemporaryFolder folder;
  const auto files = posix_file_system();
  ASSERT_TRUE(files->open_append(folder / "RESERVE").ok());
  const DiskSpace space(files, folder / ".", {4 * kMiB, kMiB});
  EXPECT_EQ(files->open_read(folder / "RESERVE").or_throw()->size(), kMiB);
}

TEST_F(DiskSpaceTest, AFailedWriteOverridesTheReportedFreeSpace) {
  options.believe_failure = std::chrono::hours(1);
  DiskSpace space = open();
  space.note_failure();
  EXPECT_EQ(space.check().reason(), Reason::DISK_FULL);
}

TEST_F(DiskSpaceTest, TheFileSystemIsNotAskedEachTime) {
  options.ask_every = std::chrono::hours(1);
  DiskSpace space = open();
  faults->free = 0;
  EXPECT_TRUE(space.check().ok());
}

TEST_F(DiskSpaceTest, ASmallDiskHasASmallMark) {
  faults->size = 160 * kMiB;
  DiskSpace space = open();
  faults->free = 10 * kMiB;
  EXPECT_TRUE(space.check().ok());
  faults->free = 9 * kMiB;
  EXPECT_EQ(space.check().reason(), Reason::DISK_FULL);
}

TEST_F(DiskSpaceTest, AnExistingReserveIsKeptAndOneThatDoesNotFitIsNotMade) {
  { DiskSpace space = open(); }
  faults->free = 1 * kMiB;
  DiskSpace again = open();
  EXPECT_TRUE(again.give_up_reserve());
  DiskSpace without = open();
  EXPECT_FALSE(reserved());
}

TEST(DiskSpaceOnDisk, TheReserveOccupiesItsBytes) {
  const TemporaryFolder folder;
  const auto files = posix_file_system();
  ASSERT_TRUE(files->occupy(folder / "file", 3 * kMiB).ok());
  EXPECT_EQ(files->open_read(folder / "file").value()->size(), 3 * kMiB);
  EXPECT_GT(files->room(folder / "").value().size, files->room(folder / "").value().free);
  EXPECT_EQ(files->room(folder / "nowhere").reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(files->occupy(folder / "much", std::uint64_t{1} << 60).ok(), false);
  EXPECT_EQ(files->open_read(folder / "much").reason(), Reason::NO_SUCH_FILE);
}

}  // namespace
}  // namespace relmap::storage
