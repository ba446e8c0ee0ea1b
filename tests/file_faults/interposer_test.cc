// What interposer.cc records of a program, and how it makes it fail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "storage/testing/temporary_folder.h"
#include "tests/file_faults/disk_model.h"
#include "tests/file_faults/traced_program.h"
#include "tests/support/process.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

using ::testing::HasSubstr;

class Interposer : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_ / "disk/there"); }
  Finished shell(const FileFaults& faults, const std::string& script) const {
    return run_program({"/bin/sh", "-c", "cd " + (folder_ / "disk") + " && " + script}, kPatience,
                       faults.environment());
  }
  Finished verify_same(const std::string& a, const std::string& b) const { return run_program({"diff", "-r", a, b}); }

  const storage::TemporaryFolder folder_;
};

TEST_F(Interposer, WhatItRecordsMakesTheSameFilesAgain) {
  fs::create_symlink("there", folder_ / "disk/link");  // of which nothing is recorded
  const FileFaults faults(folder_ / "disk", folder_ / "notes", Recording::kOn);
  DiskModel disk(folder_ / "disk");
  const Finished run =
      shell(faults,
            "mkdir -p a/b && echo one > a/b/file && echo two >> a/b/file && ln a/b/file a/second && "
            "mv a/b there/c && truncate -s 5 a/second && cp a/second copy && sync copy && rm a/second && "
            "mkdir gone && rmdir gone && echo three > link/../link/linked && rm link");
  ASSERT_EQ(run.exit_code, 0) << run.standard_error;
  const auto operations = faults.operations();
  EXPECT_EQ(operations.size(), faults.recorded());
  for (const FileOperation& operation : operations) disk.apply(operation);
  disk.lay_out(folder_ / "again", Survives::kEverything);
  const Finished same = verify_same(folder_ / "disk", folder_ / "again");
  EXPECT_EQ(same.exit_code, 0) << same.standard_output;
  EXPECT_TRUE(fs::exists(folder_ / "again/there/linked"));
  EXPECT_EQ(read_text(folder_ / "again/copy"), "one\nt");
}

TEST_F(Interposer, TheNthOperationFailsOnce) {
  FileFaults faults(folder_ / "disk", folder_ / "notes", Recording::kOff);
  faults.fail(FaultKind::kOpen, 2, EMFILE);
  const Finished run = shell(faults, "echo 1 > one; echo 2 > two; echo 3 > three");
  EXPECT_THAT(run.standard_error, HasSubstr("two"));
  EXPECT_TRUE(fs::exists(folder_ / "disk/one"));
  EXPECT_FALSE(fs::exists(folder_ / "disk/two"));
  EXPECT_TRUE(fs::exists(folder_ / "disk/three"));
  EXPECT_TRUE(faults.hit());
  EXPECT_EQ(faults.count(FaultKind::kOpen), 3u);

  FileFaults writes(folder_ / "disk", folder_ / "notes", Recording::kOff);
  writes.fail(FaultKind::kWrite, 1, EIO);
  EXPECT_THAT(shell(writes, "cp one four").standard_error, HasSubstr("Input/output error"));
  FileFaults syncs(folder_ / "disk", folder_ / "notes", Recording::kOn);
  syncs.fail(FaultKind::kSync, 1, EIO);
  EXPECT_THAT(shell(syncs, "sync one").standard_error, HasSubstr("Input/output error"));
  const auto operations = syncs.operations();
  EXPECT_EQ(std::count_if(operations.begin(), operations.end(),
                          [](const FileOperation& one) { return one.kind == OperationKind::kFailedSync; }),
            1);
}

TEST_F(Interposer, AFullDiskTakesAPartOfAWriteAndNothingOfTheNext) {
  FileFaults faults(folder_ / "disk", folder_ / "notes", Recording::kOn);
  faults.fail(FaultKind::kWrite, 1, ENOSPC);
  EXPECT_THAT(shell(faults, "dd if=/dev/zero of=file bs=1000 count=1").standard_error, HasSubstr("No space left"));
  EXPECT_EQ(fs::file_size(folder_ / "disk/file"), 500u);
  std::size_t bytes = 0;
  for (const FileOperation& operation : faults.operations()) bytes += operation.bytes.size();
  EXPECT_EQ(bytes, 500u);
}

TEST_F(Interposer, WhatCannotBeRecordedEndsTheProgram) {
  const FileFaults faults(folder_ / "disk", folder_ / "notes", Recording::kOn);
  EXPECT_EQ(shell(faults, "ln -s there link").exit_code, 99);
  EXPECT_EQ(shell(faults, "ln -s there ../link").exit_code, 0);
}

TEST_F(Interposer, AnotherNameOfTheFolderIsTheSameFolder) {
  fs::create_directory_symlink(folder_ / "disk", folder_ / "alias");
  const FileFaults faults(folder_ / "disk", folder_ / "notes", Recording::kOn);
  EXPECT_EQ(shell(faults, "echo one > " + (folder_ / "alias/one") + " && rm " + (folder_ / "alias/one")).exit_code, 0);
  EXPECT_EQ(faults.operations().size(), faults.recorded());
  EXPECT_GE(faults.recorded(), 4u) << "open, write, close, remove";
}

TEST_F(Interposer, TheNthOperationHangs) {
  FileFaults faults(folder_ / "disk", folder_ / "notes", Recording::kOff);
  faults.fail(FaultKind::kWrite, 2, 0, std::chrono::milliseconds(300));
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(shell(faults, "echo 1 > one; echo 2 > two").exit_code, 0);
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(300));
  EXPECT_EQ(read_text(folder_ / "disk/two"), "2\n");
}

TEST_F(Interposer, OnlyAllocationsOfTheProgramItselfAreCounted) {
  FileFaults faults(folder_ / "disk", folder_ / "notes", Recording::kOff);
  const auto help = [&] {
    return run_program({built_program("relmap-admin"), "--help"}, kPatience, faults.environment());
  };
  EXPECT_EQ(help().exit_code, 0);
  EXPECT_GT(faults.count(FaultKind::kAllocation), 10u);
  faults.fail(FaultKind::kAllocation, faults.count(FaultKind::kAllocation) + 5, 1);
  EXPECT_NE(help().exit_code, 0);
  EXPECT_TRUE(faults.hit());
}

}  // namespace
}  // namespace relmap::testing
