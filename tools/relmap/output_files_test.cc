#include "tools/relmap/output_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "storage/testing/temporary_folder.h"

namespace relmap::cli {
namespace {

std::string text_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

void write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

std::size_t files_in(const std::string& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(OutputFiles, EachPartGetsAFileWhenAllAreWritten) {
  const storage::TemporaryFolder folder;
  write(folder / "map.tum", "old");
  std::ostringstream standard_output;
  {
    OutputFiles files(folder / "map.tum", standard_output);
    EXPECT_FALSE(files.takes_one());
    **files.begin("") << "one";
    **files.begin("2-0") << "two";
    EXPECT_EQ(text_of(folder / "map.tum"), "old");
    ASSERT_TRUE(files.finish().ok());
  }
  EXPECT_EQ(text_of(folder / "map.tum"), "one");
  EXPECT_EQ(text_of(folder / "map.2-0.tum"), "two");
  EXPECT_EQ(files_in(folder / ""), 2u);
  EXPECT_EQ(standard_output.str(), "");
}

TEST(OutputFiles, PartsOfAnEarlierExportAreKnown) {
  const storage::TemporaryFolder folder;
  for (const char* name : {"map.1-0.tum", "map.2-0.tum", "map.old.tum", "map.3-0.g2o", "map.3-.tum", "other.3-0.tum"})
    write(folder / name, "old");
  std::ostringstream standard_output;
  OutputFiles files(folder / "map.tum", standard_output);
  **files.begin("") << "one";
  **files.begin("2-0") << "two";
  ASSERT_TRUE(files.finish().ok());
  EXPECT_EQ(files.left_behind(), (std::vector<std::string>{folder / "map.1-0.tum"}));
}

TEST(OutputFiles, AnAbandonedExportChangesNothing) {
  const storage::TemporaryFolder folder;
  write(folder / "map.tum", "old");
  std::ostringstream standard_output;
  {
    OutputFiles files(folder / "map.tum", standard_output);
    **files.begin("") << "one";
    **files.begin("2-0") << "two";
  }
  EXPECT_EQ(text_of(folder / "map.tum"), "old");
  EXPECT_EQ(files_in(folder / ""), 1u);
}

TEST(OutputFiles, StandardOutputAndDevicesTakeOnePart) {
  std::ostringstream standard_output;
  for (const char* name : {"", "-"}) {
    OutputFiles files(name, standard_output);
    EXPECT_TRUE(files.takes_one());
    EXPECT_TRUE(files.is_standard_output());
    EXPECT_EQ(files.name("2-0"), "-");
    **files.begin("") << "data";
    EXPECT_TRUE(files.finish().ok());
  }
  EXPECT_EQ(standard_output.str(), "datadata");
  OutputFiles device("/dev/null", standard_output);
  EXPECT_TRUE(device.takes_one());
  EXPECT_FALSE(device.is_standard_output());
}

TEST(OutputFiles, WhatCannotBeWrittenIsNamed) {
  std::ostringstream standard_output;
  OutputFiles nowhere("/no/such/folder/map.tum", standard_output);
  EXPECT_EQ(nowhere.begin("").reason(), Reason::IO_ERROR);
  OutputFiles full("/dev/full", standard_output);
  const auto begun = full.begin("");
  ASSERT_TRUE(begun.ok());
  **begun << "data";
  EXPECT_EQ(full.finish().reason(), Reason::IO_ERROR);
}

TEST(Spool, KeepsBytesAndLeavesNoFileBehind) {
  const storage::TemporaryFolder folder;
  {
    Spool spool(folder / "map.ply"), empty(folder / "map.ply");
    ASSERT_TRUE(spool.append("one ").ok());
    ASSERT_TRUE(spool.append("two").ok());
    std::ostringstream out;
    EXPECT_TRUE(empty.copy_to(out).ok());
    EXPECT_TRUE(spool.copy_to(out).ok());
    EXPECT_EQ(out.str(), "one two");
    EXPECT_EQ(files_in(folder / ""), 1u);
  }
  EXPECT_EQ(files_in(folder / ""), 0u);
  Spool nowhere("/no/such/folder/map.ply");
  EXPECT_EQ(nowhere.append("x").reason(), Reason::IO_ERROR);
}

}  // namespace
}  // namespace relmap::cli
