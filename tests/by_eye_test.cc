// A short trial of `relmap-bench by-eye`: a sheet of closures of a rendered drive, and which of its pairs is wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/simulated_recording.h"
#include "tests/support/streamed_sessions.h"

namespace relmap::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

TEST(ByEye, DrawsSheetsAndKeepsTheKeyOrSaysThatItCannot) {
  const storage::TemporaryFolder folder;
  StreamedSessions drive({"--deterministic"});
  drive.stream("sim",
               record_simulation(folder / "drive", {"--seed", "5", "--pairs", "150", "--laps", "1.25", "--step", "0.25",
                                                    "--width", "320"}),
               "robot");
  const auto draw = [&](const std::string& key) {
    return run_program({built_program("relmap-bench"), "by-eye", "--server", drive.server(), "--out", folder / "sheets",
                        "--key", key, "--sheets", "2", "--pairs", "3", "--tries", "20", "--apart", "2"});
  };
  const Finished done = draw(folder / "key.txt");
  ASSERT_EQ(done.exit_code, 0) << done.standard_error;
  EXPECT_THAT(read_text(folder / "key.txt"), MatchesRegex("sheet 1: pair [123]\nsheet 2: pair [123]\n"));
  for (const char* sheet : {"sheets/sheet1.png", "sheets/sheet2.png"})
    EXPECT_THAT(read_text(folder / sheet), StartsWith("\x89PNG")) << sheet;
  EXPECT_FALSE(std::filesystem::exists(folder / "sheets/sheet3.png"));

  // Without the key, sheets are worth nothing.
  const Finished lost = draw(folder / "nowhere/key.txt");
  EXPECT_NE(lost.exit_code, 0);
  EXPECT_THAT(lost.standard_error, HasSubstr("IO_ERROR"));
}

}  // namespace
}  // namespace relmap::testing
