#include "tests/file_faults/disk_model.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdio.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::IsSubsetOf;
using ::testing::UnorderedElementsAre;

constexpr int kSeeds = 80;

// What is in the folder: "name=contents", and "name/" for folders.
std::set<std::string> contents(const std::string& folder) {
  std::set<std::string> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    all.insert(entry.is_directory() ? name + "/" : name + "=" + read_text(entry.path().string()));
  }
  return all;
}

class DiskModelTest : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "start");
    std::ofstream(folder_ / "start/old") << "old";
  }
  DiskModel& disk() {
    if (!disk_) disk_ = std::make_unique<DiskModel>(folder_ / "start");
    return *disk_;
  }
  void open(const std::string& path, int fd = 3, int flags = O_CREAT) {
    disk().apply({OperationKind::kOpen, fd, flags, path, {}, 0, {}});
  }
  void write(std::uint64_t offset, const std::string& bytes, int fd = 3) {
    disk().apply({OperationKind::kWrite, fd, 0, {}, {}, offset, bytes});
  }
  void resize(std::uint64_t size, int fd = 3) { disk().apply({OperationKind::kResize, fd, 0, {}, {}, size, {}}); }
  void sync(int fd = 3) { disk().apply({OperationKind::kSync, fd, 0, {}, {}, 0, {}}); }
  void fail_sync(int fd = 3) { disk().apply({OperationKind::kFailedSync, fd, 0, {}, {}, 0, {}}); }
  void sync_folder(const std::string& path) {
    open(path, 9, 0);
    sync(9);
  }
  void rename(const std::string& from, const std::string& to, int flags = 0) {
    disk().apply({OperationKind::kRename, -1, flags, from, to, 0, {}});
  }
  void remove(const std::string& path) { disk().apply({OperationKind::kRemove, -1, 0, path, {}, 0, {}}); }
  void make_folder(const std::string& path) { disk().apply({OperationKind::kMakeFolder, -1, 0, path, {}, 0, {}}); }

  std::set<std::string> after(Survives survives, std::uint64_t seed = 0) {
    const storage::TemporaryFolder left;
    disk().lay_out(left / "disk", survives, seed);
    return contents(left / "disk");
  }
  // All that different failures leave.
  std::set<std::set<std::string>> possible() {
    std::set<std::set<std::string>> all;
    for (int seed = 0; seed < kSeeds; ++seed) all.insert(after(Survives::kSome, static_cast<std::uint64_t>(seed)));
    return all;
  }

  using State = std::set<std::string>;
  const storage::TemporaryFolder folder_;
  std::unique_ptr<DiskModel> disk_;
};

TEST_F(DiskModelTest, WhatWasThereIsDurable) {
  for (const Survives survives : {Survives::kDurable, Survives::kEverything, Survives::kSome})
    EXPECT_THAT(after(survives), UnorderedElementsAre("old=old"));
}

TEST_F(DiskModelTest, AFileNeedsASyncOfItsOwnAndOneOfItsFolder) {
  open("new");
  write(0, "abc");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("old=old"));
  EXPECT_THAT(after(Survives::kEverything), UnorderedElementsAre("old=old", "new=abc"));
  EXPECT_EQ(possible(),
            (std::set<State>{
                {"old=old"}, {"old=old", "new="}, {"old=old", "new=abc"}, {"old=old", std::string("new=\0\0\0", 7)}}));
  sync();
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("old=old"));
  EXPECT_EQ(possible(), (std::set<State>{{"old=old"}, {"old=old", "new=abc"}}));
  sync_folder("");
  EXPECT_EQ(possible(), (std::set<State>{{"old=old", "new=abc"}}));
  write(3, "d");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("old=old", "new=abc"));
}

TEST_F(DiskModelTest, AFileWithoutASyncOfItsOwnIsNamedEmpty) {
  open("new");
  write(0, "abc");
  sync_folder("");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("old=old", "new="));
}

TEST_F(DiskModelTest, SectorsReachTheDiskInAnyOrder) {
  open("old", 3, 0);
  write(0, std::string(1024, 'a'));
  sync();
  write(0, std::string(1024, 'b'));
  const std::string a(512, 'a'), b(512, 'b');
  EXPECT_EQ(possible(), (std::set<State>{{"old=" + a + a}, {"old=" + a + b}, {"old=" + b + a}, {"old=" + b + b}}));
}

TEST_F(DiskModelTest, ALongWriteReachesTheDiskPieceByPiece) {
  open("long");
  sync_folder("");
  write(0, std::string(2048, 'x'));
  std::set<std::size_t> sizes;
  for (const State& state : possible()) sizes.insert(state.begin()->size() - 5);
  EXPECT_THAT(sizes, UnorderedElementsAre(0, 512, 1024, 1536, 2048));
}

TEST_F(DiskModelTest, WhatWasCutOffMayComeBackOrNot) {
  open("old", 3, 0);
  resize(1);
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("old=old"));
  EXPECT_THAT(possible(), Contains(State{"old=old"}));
  EXPECT_THAT(possible(), Contains(State{"old=o"}));
  resize(3);
  EXPECT_THAT(after(Survives::kEverything), UnorderedElementsAre(std::string("old=o\0\0", 7)));
  sync();
  EXPECT_EQ(possible(), (std::set<State>{{std::string("old=o\0\0", 7)}}));
}

TEST_F(DiskModelTest, ARenameHappensWhollyOrNotAtAll) {
  open("draft");
  write(0, "new");
  sync();
  rename("draft", "old");
  EXPECT_EQ(possible(), (std::set<State>{{"old=old"}, {"draft=new", "old=old"}, {"old=new"}}));
  sync_folder("");
  EXPECT_EQ(possible(), (std::set<State>{{"old=new"}}));
}

TEST_F(DiskModelTest, NamesOfOneFolderDoNotWaitForEachOther) {
  open("first");
  open("second", 4);
  EXPECT_EQ(possible().size(), 4u);
  remove("first");
  remove("old");
  EXPECT_THAT(possible(), Contains(State{"first=", "second="})) << "removed, and back";
  EXPECT_THAT(possible(), Contains(State{}));
}

TEST_F(DiskModelTest, AFolderIsLostWithAllThatIsInIt) {
  make_folder("a");
  open("a/file");
  write(0, "abc");
  sync();
  sync_folder("a");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("old=old"));
  EXPECT_EQ(possible(), (std::set<State>{{"old=old"}, {"old=old", "a/", "a/file=abc"}}));
  sync_folder("");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("old=old", "a/", "a/file=abc"));
}

TEST_F(DiskModelTest, ARenameBetweenFoldersNeedsTheSyncsOfBoth) {
  make_folder("a");
  sync_folder("");
  rename("old", "a/old");
  EXPECT_EQ(possible(), (std::set<State>{{"old=old", "a/"}, {"a/", "a/old=old"}})) << "never both, never neither";
  sync_folder("a");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("old=old", "a/"));
  sync_folder("");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("a/", "a/old=old"));
}

TEST_F(DiskModelTest, AnExchangeHappensWhollyOrNotAtAll) {
  make_folder("a");
  open("a/file");
  sync_folder("a");
  sync_folder("");
  rename("a", "old", RENAME_EXCHANGE);
  EXPECT_EQ(possible(), (std::set<State>{{"old=old", "a/", "a/file="}, {"a=old", "old/", "old/file="}}));
}

TEST_F(DiskModelTest, ALaterNameIsNotDurableWithoutTheEarlierRename) {
  make_folder("a");
  sync_folder("");
  rename("old", "a/old");
  open("old");
  sync();
  sync_folder("");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("a/", "a/old=old", "old="));
}

TEST_F(DiskModelTest, ASyncThatFailsDropsWhatItWasToWrite) {
  open("old", 3, 0);
  write(0, std::string(2048, 'x'));
  fail_sync();
  write(2048, "y");
  sync();
  const std::string left = *after(Survives::kDurable).begin();
  EXPECT_EQ(left.size(), 4u + 2049) << "what follows is written where it belongs";
  EXPECT_EQ(left.back(), 'y');
  EXPECT_LT(std::count(left.begin(), left.end(), 'x'), 2048);
  EXPECT_EQ(possible(), (std::set<State>{{left}}));
}

TEST_F(DiskModelTest, FoldersThatWereThereMayBeRemoved) {
  fs::create_directories(folder_ / "start/a/b");
  std::ofstream(folder_ / "start/a/b/file") << "abc";
  rename("a/b/file", "file");
  remove("a/b");
  remove("a");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("old=old", "a/", "a/b/", "a/b/file=abc"));
  EXPECT_THAT(after(Survives::kEverything), UnorderedElementsAre("old=old", "file=abc"));
  EXPECT_GT(possible().size(), 2u);
}

TEST_F(DiskModelTest, WhatIsNotThereIsNoOperation) {
  EXPECT_THROW(rename("none", "other"), std::runtime_error);
  EXPECT_THROW(remove("none"), std::runtime_error);
  EXPECT_THROW(disk().apply({OperationKind::kLink, -1, 0, "none", "old", 0, {}}), std::runtime_error);
  EXPECT_THROW(open("none", 3, 0), std::runtime_error);
  EXPECT_THROW(sync(7), std::runtime_error);
  EXPECT_THAT(after(Survives::kEverything), UnorderedElementsAre("old=old"));
}

TEST_F(DiskModelTest, AnOpenFileStaysTheSameWhateverItIsCalled) {
  open("old", 3, 0);
  rename("old", "other");
  write(0, "OLD");
  sync();
  sync_folder("");
  EXPECT_THAT(after(Survives::kDurable), UnorderedElementsAre("other=OLD"));
}

}  // namespace
}  // namespace relmap::testing
