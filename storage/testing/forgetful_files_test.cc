// The disk of the crash tests is at least as unkind as a real one.
#include "storage/testing/forgetful_files.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace relmap::storage {
namespace {

constexpr std::size_t kSector = 512;

Bytes read(const ForgetfulFiles& disk, const std::string& path) {
  const auto file = disk.open_read(path);
  return file.ok() ? (*file)->read(0, (*file)->size()).value() : Bytes();
}

// One durable file of a sector and a half of ones.
std::shared_ptr<ForgetfulFiles> disk_with_a_file(std::uint64_t seed) {
  auto disk = ForgetfulFiles::create(seed);
  auto file = disk->open_append("d/f").value();
  EXPECT_TRUE(file->append(Bytes(768, 1)).ok() && file->sync().ok() && disk->sync_directory("d").ok());
  return disk;
}

// Counts for how many of `runs` seeds something holds.
int count(int runs, const std::function<bool(std::uint64_t seed)>& holds) {
  int n = 0;
  for (int seed = 1; seed <= runs; ++seed) n += holds(static_cast<std::uint64_t>(seed));
  return n;
}

TEST(ForgetfulFiles, WhatWasSyncedStaysWhateverHappensBehindIt) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const auto disk = disk_with_a_file(seed);
    ASSERT_TRUE(disk->open_append("d/f").value()->append(Bytes(2000, 2)).ok());
    disk->restart();
    const Bytes left = read(*disk, "d/f");
    ASSERT_GE(left.size(), 768u);
    EXPECT_TRUE(std::all_of(left.begin(), left.begin() + 768, [](auto b) { return b == 1; }));
  }
}

TEST(ForgetfulFiles, AFolderMayBeGoneWithAllThatIsInItUntilTheOneAboveIsSynced) {
  const auto fill = [](ForgetfulFiles& disk) {
    auto file = disk.open_append("above/d/f").value();
    EXPECT_TRUE(file->append(Bytes(768, 1)).ok() && file->sync().ok() && disk.sync_directory("above/d").ok());
  };
  const auto gone = [&](std::uint64_t seed) {
    const auto disk = ForgetfulFiles::create(seed);
    EXPECT_TRUE(disk->create_directory("above/d").ok());
    fill(*disk);
    disk->restart();
    return read(*disk, "above/d/f").empty();
  };
  const int lost = count(100, gone);
  EXPECT_GT(lost, 20);
  EXPECT_LT(lost, 80);
  const auto kept = [&](std::uint64_t seed) {
    const auto disk = ForgetfulFiles::create(seed);
    EXPECT_TRUE(create_durable_directory(*disk, "above/d").ok());
    fill(*disk);
    disk->restart();
    return read(*disk, "above/d/f").size() == 768;
  };
  EXPECT_EQ(count(100, kept), 100);
}

TEST(ForgetfulFiles, KeepsAFolderAndAllAboveItThatWereMissing) {
  const auto kept = [&](std::uint64_t seed) {
    const auto disk = ForgetfulFiles::create(seed);
    EXPECT_TRUE(create_durable_directories(*disk, "above/a/b/c/").ok());
    auto file = disk->open_append("above/a/b/c/f").value();
    EXPECT_TRUE(file->append(Bytes(768, 1)).ok() && file->sync().ok() && disk->sync_directory("above/a/b/c").ok());
    disk->restart();
    return read(*disk, "above/a/b/c/f").size() == 768;
  };
  EXPECT_EQ(count(100, kept), 100);
  EXPECT_EQ(folder_of("a/b/"), "a");
  EXPECT_EQ(folder_of("a/"), ".");
  EXPECT_EQ(folder_of("/"), "/");
}

TEST(ForgetfulFiles, ALaterSectorMayBeThereWithoutAnEarlierOne) {
  const auto out_of_order = [](std::uint64_t seed) {
    const auto disk = disk_with_a_file(seed);
    (void)disk->open_append("d/f").value()->append(Bytes(4 * kSector, 2));
    disk->restart();
    Bytes left = read(*disk, "d/f");
    left.resize(768 + 4 * kSector);
    return left[1200] == 0 && left[4 * kSector - 1] == 2;
  };
  EXPECT_GT(count(300, out_of_order), 5);
}

TEST(ForgetfulFiles, AFileMayHaveItsNewLengthAndNothingInIt) {
  const auto hollow = [](std::uint64_t seed) {
    const auto disk = disk_with_a_file(seed);
    (void)disk->open_append("d/f").value()->append(Bytes(4 * kSector, 2));
    disk->restart();
    const Bytes left = read(*disk, "d/f");
    return left.size() == 768 + 4 * kSector && left[900] == 0 && left.back() == 0;
  };
  EXPECT_GT(count(100, hollow), 5);
}

TEST(ForgetfulFiles, NamesMadeAndRemovedMayStandOrNotUntilTheFolderIsSynced) {
  const auto made = [](std::uint64_t seed) {
    const auto disk = disk_with_a_file(seed);
    (void)disk->open_append("d/g").value()->sync();
    disk->restart();
    return disk->open_read("d/g").ok();
  };
  const auto removed = [](std::uint64_t seed) {
    const auto disk = disk_with_a_file(seed);
    (void)disk->remove("d/f");
    disk->restart();
    return !disk->open_read("d/f").ok();
  };
  EXPECT_NEAR(count(100, made), 50, 25);
  EXPECT_NEAR(count(100, removed), 50, 25);
}

TEST(ForgetfulFiles, ATruncationWhoseSyncFailsMayNotHaveHappened) {
  const auto undone = [](std::uint64_t seed) {
    const auto disk = disk_with_a_file(seed);
    disk->fail_syncs(1);
    EXPECT_FALSE(disk->truncate("d/f", 10).ok());
    disk->restart();
    return read(*disk, "d/f").size() == 768;
  };
  EXPECT_GT(count(100, undone), 20);
}

TEST(ForgetfulFiles, ASyncThatSucceedsAfterOneThatFailedDoesNotBringTheBytesBack) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto disk = disk_with_a_file(seed);
    auto file = disk->open_append("d/f").value();
    ASSERT_TRUE(file->append(Bytes(4 * kSector, 2)).ok());
    disk->fail_syncs(1);
    EXPECT_FALSE(file->sync().ok());
    EXPECT_TRUE(file->sync().ok());
    disk->restart();
    const Bytes left = read(*disk, "d/f");
    EXPECT_EQ(left.size(), 768 + 4 * kSector);
    EXPECT_EQ(std::count(left.begin(), left.end(), 2), 0);
  }
}

TEST(ForgetfulFiles, CertainIsWhatNoFailureTakes) {
  const auto disk = disk_with_a_file(1);
  ASSERT_TRUE(disk->open_append("d/f").value()->append(Bytes(100, 2)).ok());
  ASSERT_TRUE(disk->open_append("d/g").value()->sync().ok());
  const auto certain = disk->certain("d");
  EXPECT_EQ(read(*certain, "d/f"), Bytes(768, 1));
  EXPECT_FALSE(certain->open_read("d/g").ok());
  EXPECT_EQ(read(*disk, "d/f").size(), 868u);
}

}  // namespace
}  // namespace relmap::storage
