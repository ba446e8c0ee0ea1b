// What `cmake --install` installs is complete: the programs find what belongs to them, and a stranger's program builds
// against the client, by CMake and by pkg-config, and asks a running daemon.
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kSources = RELMAP_SOURCE_DIR "/tests/installed";

void must_run(const std::vector<std::string>& command, const std::vector<std::string>& environment = {}) {
  const Finished done = run_program(command, kPatience, environment);
  if (done.exit_code != 0) throw std::runtime_error(command[0] + ": " + done.standard_output + done.standard_error);
}

class Installed : public ::testing::Test {
 protected:
  void install(const std::string& component) const {
    must_run({"cmake", "--install", RELMAP_BIN_DIR "/..", "--prefix", prefix_, "--component", component, "--strip"});
  }
  // All files below the prefix, or a folder of it.
  std::set<std::string> files(const std::string& folder = "") const {
    std::set<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(prefix_) / folder))
      if (!entry.is_directory()) found.insert(fs::relative(entry.path(), prefix_));
    return found;
  }

  const storage::TemporaryFolder folder_;
  const std::string prefix_ = folder_ / "prefix";
};

TEST_F(Installed, EachComponentHasItsPrograms) {
  for (const char* component : {"server", "frontend", "console", "tools"}) install(component);
  EXPECT_EQ(files("bin"),
            (std::set<std::string>{"bin/relmap", "bin/relmap-admin", "bin/relmap-camera", "bin/relmap-console",
                                   "bin/relmap-frontend", "bin/relmap-sim", "bin/relmap-vocab", "bin/relmapd"}));
  EXPECT_TRUE(files().contains("lib/relmap/relmap-camera-1394"));
  EXPECT_FALSE(fs::exists(fs::path(prefix_) / "include")) << "of component dev";

  // The shipped vocabulary and the helper of relmap-camera are found from where the programs are.
  const Finished vocabulary = run_program({prefix_ + "/bin/relmap-vocab", "info"});
  EXPECT_EQ(vocabulary.exit_code, 0) << vocabulary.standard_error;
  const std::vector<std::string> cameras{prefix_ + "/bin/relmap-camera", "list", "--bus", "1394"};
  EXPECT_THAT(run_program(cameras).standard_error, Not(HasSubstr("which is not installed")));
  fs::remove(prefix_ + "/lib/relmap/relmap-camera-1394");
  EXPECT_THAT(run_program(cameras).standard_error, HasSubstr("which is not installed"));
}

TEST_F(Installed, UnitsNameTheProgramsOfTheirPrefix) {
  for (const char* component : {"server", "frontend", "console"}) install(component);
  for (const auto& [unit, program] :
       {std::pair("relmapd", "relmapd"), std::pair("relmap-frontend@", "relmap-frontend"),
        std::pair("relmap-backup", "relmap-admin"), std::pair("relmap-console", "relmap-console")}) {
    const std::string text = read_text(prefix_ + "/lib/systemd/system/" + unit + ".service");
    EXPECT_THAT(text, HasSubstr("\nExecStart=" + prefix_ + "/bin/" + program + " "));
    EXPECT_THAT(text, Not(HasSubstr("@prefix@")));
    EXPECT_THAT(text, HasSubstr("Documentation=file:" + prefix_ + "/share/doc/relmap/"));
  }
}

TEST_F(Installed, UnitsAreSoundAndClosed) {
  for (const char* component : {"server", "frontend", "console"}) install(component);
  const std::string units = prefix_ + "/lib/systemd/system/";
  for (const std::string& unit : {units + "relmapd.service", units + "relmap-frontend@.service",
                                  units + "relmap-backup.service", units + "relmap-console.service"}) {
    const Finished closed =
        run_program({"systemd-analyze", "security", "--offline=true", "--threshold=30", "--no-pager", unit});
    EXPECT_EQ(closed.exit_code, 0) << closed.standard_output << closed.standard_error;
    const Finished sound = run_program({"systemd-analyze", "verify", "--man=no", "--recursive-errors=no", unit});
    EXPECT_EQ(sound.exit_code, 0) << sound.standard_error;
  }
  const Finished users =
      run_program({"systemd-sysusers", "--dry-run", prefix_ + "/lib/sysusers.d/relmapd.conf",
                   prefix_ + "/lib/sysusers.d/relmap-frontend.conf", prefix_ + "/lib/sysusers.d/relmap-console.conf"});
  EXPECT_EQ(users.exit_code, 0) << users.standard_error;
}

// A daemon that hangs is started again within 30 s: it counts as hung, is silent, is given time for its last words.
TEST_F(Installed, ADaemonThatHangsIsStartedAgainWithinHalfAMinute) {
  const std::string unit = read_text(RELMAP_SOURCE_DIR "/tools/ops/systemd/relmapd.service");
  const auto seconds_of = [&](const std::string& setting) {
    const std::size_t at = unit.find("\n" + setting + "=");
    EXPECT_NE(at, std::string::npos) << setting;
    return std::stod(unit.substr(at + setting.size() + 2));
  };
  const std::string sample = read_text(RELMAP_SOURCE_DIR "/server/ops/relmapd.yaml");
  const double hung_s = std::stod(sample.substr(sample.find("#hung_after_s: ") + 15)), tick_s = 1;
  EXPECT_LE(hung_s + tick_s + seconds_of("WatchdogSec") + seconds_of("TimeoutAbortSec") + seconds_of("RestartSec"), 30);
}

TEST_F(Installed, WhatNoRestartMendsIsNotTriedAgain) {
  const std::string unit = read_text(RELMAP_SOURCE_DIR "/tools/ops/systemd/relmapd.service");
  EXPECT_THAT(unit, HasSubstr("\nRestartPreventExitStatus=2 5 6\n"));
  const std::string help = run_program({built_program("relmapd"), "--help"}).standard_output;
  EXPECT_THAT(help, HasSubstr("\n  2  BAD_CONFIG"));
  EXPECT_THAT(help, HasSubstr("\n  5  the data folder cannot be used"));
  EXPECT_THAT(help, HasSubstr("\n  6  the vocabulary cannot be used"));
}

TEST_F(Installed, ThePackagesHaveTheVersionOfThePrograms) {
  const std::string changelog = read_text(RELMAP_SOURCE_DIR "/debian/changelog");
  const std::string version = changelog.substr(changelog.find('(') + 1, changelog.find(')') - changelog.find('(') - 1);
  EXPECT_THAT(run_program({built_program("relmapd"), "--version"}).standard_output, HasSubstr(version));
}

TEST_F(Installed, ThePackagesAreBuiltWithWhatTheTreeIsBuiltWith) {
  const std::string control = read_text(RELMAP_SOURCE_DIR "/debian/control");
  std::istringstream packages(read_text(RELMAP_SOURCE_DIR "/tools/packages.txt"));
  for (std::string package; std::getline(packages, package);) {
    if (!package.ends_with("-dev") || package.starts_with("libclang")) continue;  // that is for fuzzers
    EXPECT_THAT(control, HasSubstr("\n               " + package));
  }
}

TEST_F(Installed, TheSampleOfTheConfigurationIsSound) {
  install("server");
  // With folders of this test's and a group that this machine has.
  std::string sample = read_text(prefix_ + "/share/relmap/relmapd.yaml");
  sample = std::regex_replace(sample, std::regex("/var/lib/relmap|/run/relmap"), folder_ / "");
  sample = std::regex_replace(sample, std::regex("socket_group: relmap"),
                              std::string("socket_group: ") + getgrgid(getgid())->gr_name);
  fs::create_directories(folder_ / "backups");
  std::ofstream(folder_ / "relmapd.yaml") << sample;
  const Finished checked =
      run_program({prefix_ + "/bin/relmapd", "--config", folder_ / "relmapd.yaml", "--check-config"}, kPatience);
  EXPECT_EQ(checked.exit_code, 0) << checked.standard_error;
}

TEST_F(Installed, AProgramOfAUserBuildsAndAsksADaemon) {
  install("dev");
  EXPECT_FALSE(fs::exists(prefix_ + "/bin")) << "of other components";
  const std::string by_cmake = folder_ / "build/where_am_i", by_pkg_config = folder_ / "where_am_i";
  must_run({"cmake", "-S", kSources, "-B", folder_ / "build", "-DCMAKE_PREFIX_PATH=" + prefix_});
  must_run({"cmake", "--build", folder_ / "build"});
  must_run({"sh", "-c",
            "c++ " + std::string(kSources) + "/where_am_i.cc -o " + by_pkg_config +
                " $(pkg-config --cflags --libs relmap-client)"},
           {"PKG_CONFIG_PATH=" + prefix_ + "/lib/pkgconfig"});

  const std::string drive = record_simulation(folder_ / "drive", {"--pairs", "40", "--laps", "0.3"});
  const RunningDaemon daemon({.data = folder_ / "map", .lcm = "", .more = {}});
  must_run({built_program("relmap-frontend"), "--source", "sim", drive, "--robot", "cart", "--server", folder_ / "map",
            "--spool", "none"});
  must_run({built_program("relmap"), "--server", folder_ / "map", "wait"});
  for (const std::string& program : {by_cmake, by_pkg_config}) {
    const Finished found = run_program(
        {program, folder_ / "map", drive + "/image_0/" + picture_name(20), drive + "/image_1/" + picture_name(20)});
    EXPECT_EQ(found.exit_code, 0) << found.standard_error;
    EXPECT_THAT(found.standard_output, HasSubstr("in frame 1:"));
    const Finished refused = run_program({program, folder_ / "nowhere", drive + "/calib.txt", drive + "/calib.txt"});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_THAT(refused.standard_error, HasSubstr("INVALID_ARGUMENT: "));
  }
}

TEST_F(Installed, MatricesOfAnotherLayoutAreRefusedAtCompileTime) {
  install("dev");
  const std::string source = std::string(kSources) + "/where_am_i.cc";
  const std::vector<std::string> compile{"c++", "-std=c++20",         "-fsyntax-only", "-mavx",
                                         "-I",  prefix_ + "/include", "-isystem",      "/usr/include/eigen3",
                                         source};
  const Finished refused = run_program(compile);
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_THAT(refused.standard_error, HasSubstr("-DEIGEN_MAX_STATIC_ALIGN_BYTES=16"));
  std::vector<std::string> as_told = compile;
  as_told.push_back("-DEIGEN_MAX_STATIC_ALIGN_BYTES=16");
  const Finished compiled = run_program(as_told);
  EXPECT_EQ(compiled.exit_code, 0) << compiled.standard_error;
}

TEST_F(Installed, TheProgramIsTheOneInTheReadme) {
  const std::string program = read_text(std::string(kSources) + "/where_am_i.cc");
  EXPECT_LE(std::count(program.begin(), program.end(), '\n'), 30);
  const std::string readme = read_text(RELMAP_SOURCE_DIR "/client/README.md");
  EXPECT_THAT(readme, HasSubstr("```cpp\n" + program + "```"));
  EXPECT_THAT(readme, HasSubstr("```cmake\n" + read_text(std::string(kSources) + "/CMakeLists.txt") + "```"));
}

}  // namespace
}  // namespace relmap::testing
