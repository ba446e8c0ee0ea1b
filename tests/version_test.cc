// Every program tells the same of its version, and the commit in it is that of the sources.
#include "proto/base/version.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"
#include "tests/support/process.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

TEST(Version, EveryProgramPrintsTheSameLine) {
  EXPECT_TRUE(std::regex_match(version_line(), std::regex(R"(relmap \d+\.\d+\.\d+( \([0-9a-f]{12}(-modified)?\))?)")))
      << version_line();
  std::size_t programs = 0;
  for (const auto& program : fs::directory_iterator(RELMAP_BIN_DIR)) {
    if (!program.is_regular_file()) continue;
    const Finished told = run_program({program.path(), "--version"});
    EXPECT_EQ(told.exit_code, 0) << program;
    EXPECT_EQ(told.standard_output, version_line() + "\n") << program;
    EXPECT_EQ(told.standard_error, "") << program;
    ++programs;
  }
  EXPECT_GE(programs, 10u);
}

// cmake/write_version.cmake on sources of its own.
class VersionScript : public ::testing::Test {
 protected:
  VersionScript() { fs::create_directories(sources()); }

  std::string sources() const { return folder_ / "outer/sources"; }
  void git(const std::string& where, std::vector<std::string> arguments) const {
    const std::vector<std::string> always{"git", "-C", where, "-c", "user.name=nobody", "-c", "user.email=nobody"};
    arguments.insert(arguments.begin(), always.begin(), always.end());
    const Finished done = run_program(arguments);
    EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  }
  void commit(const std::string& where) const {
    git(where, {"init", "--quiet"});
    std::ofstream(where + "/file") << "one\n";
    git(where, {"add", "file"});
    git(where, {"commit", "--quiet", "--message", "one"});
  }
  void edit() const { std::ofstream(sources() + "/file") << "another\n"; }

  // The commit that is written; `asked`: the value of RELMAP_COMMIT.
  std::string written(const std::string& asked = "") const {
    const std::string template_file = folder_ / "template", output = folder_ / "output";
    std::ofstream(template_file) << "@VERSION@ @COMMIT@\n";
    const Finished done = run_program({"cmake", "-DSOURCE=" + sources(), "-DVERSION=1.2.3", "-DCOMMIT=" + asked,
                                       "-DTEMPLATE=" + template_file, "-DOUTPUT=" + output, "-P",
                                       RELMAP_SOURCE_DIR "/cmake/write_version.cmake"});
    EXPECT_EQ(done.exit_code, 0) << done.standard_error;
    const std::string text = read_text(output);
    EXPECT_TRUE(text.starts_with("1.2.3 ") && text.ends_with("\n")) << text;
    return text.substr(6, text.size() - 7);
  }
  fs::file_time_type written_at() const { return fs::last_write_time(folder_ / "output"); }

  const storage::TemporaryFolder folder_;
};

TEST_F(VersionScript, TellsTheCommitAndWhetherATrackedFileDiffers) {
  commit(sources());
  const std::string clean = written();
  EXPECT_TRUE(std::regex_match(clean, std::regex("[0-9a-f]{12}"))) << clean;
  std::ofstream(sources() + "/untracked") << "one\n";
  EXPECT_EQ(written(), clean);
  edit();
  EXPECT_EQ(written(), clean + "-modified");
}

TEST_F(VersionScript, TellsNoCommitOutsideARepositoryOfItsOwn) {
  EXPECT_EQ(written(), "");
  commit(folder_ / "outer");
  EXPECT_EQ(written(), "");
}

TEST_F(VersionScript, TellsTheCommitThatIsGiven) {
  commit(sources());
  EXPECT_EQ(written("0123456789ab"), "0123456789ab");
}

// What includes it is not compiled again.
TEST_F(VersionScript, LeavesAFileAloneThatSaysTheSame) {
  commit(sources());
  written();
  const fs::file_time_type before = written_at();
  written();
  EXPECT_EQ(written_at(), before);
  edit();
  written();
  EXPECT_NE(written_at(), before);
}

}  // namespace
}  // namespace relmap::testing
