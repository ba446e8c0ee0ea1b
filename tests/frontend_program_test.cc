// relmap-frontend on the command line: what it refuses, and what it reports.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

class FrontendProgram : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new storage::TemporaryFolder();
    for (const char* seed : {"1", "2"})
      record_simulation(drive(seed), {"--seed", seed, "--pairs", "12", "--laps", "0.1"});
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  // Drives of the same name.
  static std::string drive(const std::string& seed) { return *folder_ / (seed + "/drive"); }
  static std::string file(const std::string& name) { return *folder_ / name; }

  static Finished run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), built_program("relmap-frontend"));
    return run_program(arguments);
  }
  static bool says(const Finished& finished, const std::string& what) {
    return finished.standard_error.find(what) != std::string::npos;
  }

  static inline storage::TemporaryFolder* folder_ = nullptr;
};

TEST_F(FrontendProgram, WritesNothingOverItsSource) {
  const std::string keyframes = file("keyframes.bin");
  ASSERT_EQ(run({drive("1"), "--robot", "r", "--out", keyframes, "--quiet"}).exit_code, 0);
  const auto bytes = fs::file_size(keyframes);
  const Finished over = run({keyframes, "--out", keyframes});
  EXPECT_EQ(over.exit_code, 2);
  EXPECT_TRUE(says(over, "over the source")) << over.standard_error;
  EXPECT_EQ(run({drive("1"), "--robot", "r", "--out", file("a"), "--report", file("a")}).exit_code, 2);
  EXPECT_EQ(run({drive("1"), "--robot", "r", "--out", drive("1") + "/times.txt"}).exit_code, 2);
  EXPECT_EQ(fs::file_size(keyframes), bytes);
  // The robot is the one recorded.
  const Finished again = run({keyframes, "--out", file("again.bin"), "--json"});
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  EXPECT_NE(again.standard_output.find("\"robot\":\"r\""), std::string::npos) << again.standard_output;
}

TEST_F(FrontendProgram, RefusesWrongUse) {
  EXPECT_TRUE(says(run({drive("1"), "--out", file("b")}), "--robot"));
  EXPECT_EQ(run({drive("1"), "--robot", "", "--out", file("b")}).exit_code, 2);
  EXPECT_EQ(run({drive("1"), "--robot", "r", "--to", "file"}).exit_code, 2);
  EXPECT_EQ(run({drive("1"), "--robot", "r", "--to", "lcm", "--out", file("b")}).exit_code, 2);
  EXPECT_EQ(run({drive("1"), "--robot", "r", "--out", file("b"), "--spool", file("spool")}).exit_code, 2);
  for (const std::vector<std::string>& way :
       {std::vector<std::string>{"--to", "grpc"},
        {"--to", "lcm", "--server", file("b")},
        {"--server", "localhost:1", "--lcm", "memq://"},
        {"--server", "localhost:1", "--out", file("b")},
        {"--server", "neither"},
        {"--server", "localhost:1", "--spool", "none", "--spool-bytes", "1000"}}) {
    std::vector<std::string> arguments{drive("1"), "--robot", "r"};
    arguments.insert(arguments.end(), way.begin(), way.end());
    const Finished refused = run(arguments);
    EXPECT_EQ(refused.exit_code, 2) << way[0] << ' ' << way[1] << refused.standard_error;
  }
  EXPECT_EQ(run({"--version"}).exit_code, 0);
}

TEST_F(FrontendProgram, TheSameRecordingGivesTheSameKeyframes) {
  const auto write = [&](const std::string& name) {
    const std::string path = file(name);
    EXPECT_EQ(
        run({drive("1"), "--robot", "r", "--uuid", "7a0c1f52-5f0e-4c7d-9d43-0a8f6b1f2e11", "--out", path}).exit_code,
        0);
    return read_text(path);
  };
  const std::string once = write("once.bin");
  EXPECT_GT(once.size(), 50'000u);
  EXPECT_TRUE(once == write("twice.bin"));
}

TEST_F(FrontendProgram, NamesADaemonThatIsNotThere) {
  const Finished alone = run(
      {drive("1"), "--robot", "r", "--to", "grpc", "--server", "127.0.0.1:1", "--spool", "none", "--patience", "0"});
  EXPECT_EQ(alone.exit_code, 3) << alone.standard_error;
  EXPECT_TRUE(says(alone, "no relmapd answers on 127.0.0.1:1 (UNREACHABLE")) << alone.standard_error;
  EXPECT_NE(alone.standard_output.find("are kept nowhere; the same command with --uuid"), std::string::npos)
      << alone.standard_output;
}

TEST_F(FrontendProgram, ProgressIsAnObjectALine) {
  const Finished done = run({drive("1"), "--robot", "r", "--out", file("p.bin"), "--rate", "10", "--progress", "json"});
  EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  std::istringstream lines(done.standard_output);
  std::vector<std::string> all;
  for (std::string line; std::getline(lines, line);) all.push_back(line);
  ASSERT_GE(all.size(), 3u) << done.standard_output;
  for (const std::string& line : all) EXPECT_TRUE(line.front() == '{' && line.back() == '}') << line;
  for (const char* said : {"{\"pairs\":", ",\"of\":12,", "\"keyframes\":", "\"settled\":", "\"path_m\":"})
    EXPECT_NE(all.front().find(said), std::string::npos) << all.front();
  EXPECT_NE(all.back().find("\"error\":null"), std::string::npos) << all.back();
}

TEST_F(FrontendProgram, ReplacesNoFileOfAnotherKind) {
  const std::string calibration = drive("2") + "/calib.txt";
  const auto bytes = fs::file_size(calibration);
  EXPECT_EQ(run({drive("1"), "--robot", "r", "--out", file("c"), "--report", calibration}).exit_code, 2);
  fs::copy(calibration, file("film.mp4"));
  EXPECT_EQ(run({drive("1"), "--robot", "r", "--out", file("c"), "--show", file("film.mp4")}).exit_code, 2);
  EXPECT_EQ(fs::file_size(calibration), bytes);
  EXPECT_EQ(fs::file_size(file("film.mp4")), bytes);
}

TEST_F(FrontendProgram, LeavesAFileThatIsNotCompleteApart) {
  const std::string keyframes = file("cut.bin"), error = file("cut.txt");
  for (const bool interrupted : {false, true}) {
    ProcessOptions options;
    options.standard_error = error;
    Process process({built_program("relmap-frontend"), drive("1"), "--robot", "r", "--out", keyframes, "--rate",
                     interrupted ? "2" : "max"},
                    options);
    while (interrupted && process.running() && !fs::exists(keyframes + ".part"))
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::this_thread::sleep_for(std::chrono::milliseconds(interrupted ? 1500 : 0));
    if (interrupted) process.signal(SIGINT);
    EXPECT_EQ(process.wait(kPatience), interrupted ? 4 : 0) << read_text(error);
  }
  EXPECT_TRUE(fs::exists(keyframes + ".part"));
  EXPECT_GT(fs::file_size(keyframes), fs::file_size(keyframes + ".part"));
  EXPECT_NE(read_text(error).find("cut.bin.part has the keyframes so far"), std::string::npos) << read_text(error);
}

TEST_F(FrontendProgram, FailuresAreInItsJson) {
  const Finished failed = run({file("nowhere"), "--robot", "r", "--out", file("d"), "--json"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_NE(failed.standard_output.find("\"error\":{\"reason\":\"NO_SUCH_FILE\""), std::string::npos)
      << failed.standard_output;
  EXPECT_TRUE(says(run({drive("1"), "--robot", "a\xff", "--out", file("d")}), "BAD_NAME"));
}

TEST_F(FrontendProgram, NamesEyesThatAreExchangedOrTheSame) {
  for (const bool same : {false, true}) {
    const std::string wrong = file(same ? "same" : "exchanged");
    fs::copy(drive("1"), wrong, fs::copy_options::recursive);
    fs::remove_all(wrong + "/image_0");
    if (!same) fs::rename(wrong + "/image_1", wrong + "/image_0");
    fs::copy(drive("1") + (same ? "/image_1" : "/image_0"), wrong + (same ? "/image_0" : "/image_1"),
             fs::copy_options::recursive);
    const Finished finished = run({wrong, "--robot", "r", "--out", file("wrong.bin")});
    EXPECT_EQ(finished.exit_code, 1);
    EXPECT_TRUE(says(finished, "NOT_STEREO")) << finished.standard_error;
    EXPECT_TRUE(says(finished, same ? "same picture" : "exchanged")) << finished.standard_error;
    EXPECT_FALSE(fs::exists(file("wrong.bin")) || fs::exists(file("wrong.bin.part")));
  }
}

TEST_F(FrontendProgram, TellsAnotherRecordingOfTheSameName) {
  const std::string spool = file("spool");
  const auto send = [&](const std::string& seed) {
    return run({drive(seed), "--robot", "r", "--lcm", "memq://", "--spool", spool, "--patience", "0"});
  };
  const Finished first = send("1");
  EXPECT_EQ(first.exit_code, 3) << first.standard_error;
  EXPECT_TRUE(says(first, "no relmapd answers")) << first.standard_error;
  EXPECT_NE(first.standard_output.find("in " + spool), std::string::npos) << first.standard_output;
  const Finished again = send("1");
  EXPECT_EQ(again.exit_code, 3) << again.standard_error;
  EXPECT_TRUE(says(again, "goes on after keyframe")) << again.standard_error;
  const Finished other = send("2");
  EXPECT_EQ(other.exit_code, 2) << other.standard_error;
  EXPECT_TRUE(says(other, "another recording")) << other.standard_error;
}

// The stamps of pairs from the 4th on an hour back, as where a clock was set; the pictures of the first `pairs`.
void write_clock_set_back(const std::string& source, const std::string& into, int pairs) {
  fs::create_directories(into);
  fs::copy(source + "/calib.txt", into, fs::copy_options::overwrite_existing);
  std::ofstream times(into + "/times.txt");
  for (int i = 0; i < pairs; ++i) {
    times << std::fixed << 1'600'000'000 + 0.1 * i - (i < 4 ? 0 : 3600) << '\n';
    const std::string number = std::to_string(i), name = std::string(6 - number.size(), '0') + number + ".png";
    for (const std::string eye : {"/image_0/", "/image_1/"}) {
      fs::create_directories(into + eye);
      fs::copy(source + eye + name, into + eye + name, fs::copy_options::overwrite_existing);
    }
  }
}

// The pair and the time of every keyframe that a report has.
std::vector<std::string> keyframes_of(const std::string& report) {
  std::istringstream lines(read_text(report));
  std::vector<std::string> keyframes;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream columns(line);
    std::string pair, picture, time_us, tracked, one_eye, repeated, keyframe;
    columns >> pair >> picture >> time_us >> tracked >> one_eye >> repeated >> keyframe;
    if (keyframe == "1") keyframes.push_back(pair + " " + time_us);
  }
  return keyframes;
}

TEST_F(FrontendProgram, GoesOnWithARecordingInWhichTheClockWasSet) {
  const std::string recording = file("clock"), whole = file("clock whole.tsv"), broken = file("clock broken.tsv");
  const auto track = [&](const std::string& spool, const std::string& report) {
    return run({recording, "--source", "kitti", "--robot", "r", "--all-keyframes", "--lcm", "memq://", "--spool", spool,
                "--patience", "0", "--report", report, "--json"});
  };
  // Broken off before the clock was set, while its stamps are left out, and after; at the end there is nothing more.
  for (const int pairs : {3, 6, 10, 12, 12}) {
    write_clock_set_back(drive("1"), recording, pairs);
    const Finished part = track(file("clock spool"), broken);
    EXPECT_EQ(part.exit_code, 3) << part.standard_error;
  }
  track(file("whole clock spool"), whole);
  ASSERT_EQ(keyframes_of(whole).size(), 8u) << read_text(whole);
  EXPECT_EQ(keyframes_of(whole).back(), "11 1600000001100000");
  EXPECT_EQ(keyframes_of(broken), keyframes_of(whole));
}

TEST_F(FrontendProgram, MakesAMonoSessionOfAFolderOfPictures) {
  const std::string photos = file("photos");
  fs::create_directories(photos);
  for (int i = 0; i < 6; ++i)
    fs::copy(drive("1") + "/image_0/00000" + std::to_string(i) + ".png", photos + "/" + std::to_string(i) + ".png");
  std::ofstream(photos + "/3.png") << "no picture";
  const std::string spool = file("mono spool"), report = file("photos.tsv");
  const auto take = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{"--source", "images", "--mono", photos, "--robot", "phone", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  };
  const Finished done = take({"--out", file("photos.bin"), "--report", report});
  EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  EXPECT_TRUE(says(done, "pictures of one eye")) << done.standard_error;
  EXPECT_TRUE(says(done, "3.png: neither PNG nor JPEG")) << done.standard_error;
  for (const char* said : {"\"mono\":true", "\"pairs\":5", "\"keyframes\":5", "\"NOT_A_PICTURE\":1"})
    EXPECT_NE(done.standard_output.find(said), std::string::npos) << done.standard_output;
  EXPECT_NE(read_text(report).find("4\t4.png\t"), std::string::npos) << read_text(report);
  EXPECT_NE(read_text(report).find("# keyframes\t5"), std::string::npos) << read_text(report);
  EXPECT_EQ(run({file("photos.bin"), "--out", file("photos again.bin")}).exit_code, 0) << "keyframes as all others";

  // Spooled, and gone on with.
  const Finished spooled = take({"--lcm", "memq://", "--spool", spool, "--patience", "0"});
  EXPECT_EQ(spooled.exit_code, 3) << spooled.standard_error;
  fs::copy(drive("1") + "/image_0/000007.png", photos + "/7.png");
  const Finished more = take({"--lcm", "memq://", "--spool", spool, "--patience", "0"});
  EXPECT_TRUE(says(more, "goes on after keyframe 4")) << more.standard_error;
  EXPECT_NE(more.standard_output.find("\"unsettled\":6"), std::string::npos) << more.standard_output;
}

TEST_F(FrontendProgram, RefusesWhatNeedsPairsOfReadyMadeKeyframes) {
  const std::string keyframes = file("keyframes.bin");
  ASSERT_EQ(run({drive("1"), "--robot", "r", "--out", keyframes}).exit_code, 0);
  for (const std::vector<std::string>& of_pairs :
       {std::vector<std::string>{"--report", file("pairs.tsv")}, {"--show", file("film")}, {"--all-keyframes"}}) {
    std::vector<std::string> arguments{keyframes, "--out", file("again.bin")};
    arguments.insert(arguments.end(), of_pairs.begin(), of_pairs.end());
    const Finished refused = run(arguments);
    EXPECT_EQ(refused.exit_code, 1) << of_pairs[0];
    EXPECT_TRUE(says(refused, "UNSUPPORTED")) << of_pairs[0] << refused.standard_error;
  }
}

TEST_F(FrontendProgram, RefusesWhatNeedsTwoEyesOfAMonoSession) {
  const std::string photos = drive("1") + "/image_0", out = file("refused.bin");
  for (const std::vector<std::string>& stereo_only : {std::vector<std::string>{"--imu", "none"},
                                                      {"--show", file("film")},
                                                      {"--live"},
                                                      {"--oneway"},
                                                      {"--all-keyframes"},
                                                      {"--recorded", "x"},
                                                      {"--source", "kitti"}}) {
    std::vector<std::string> arguments{photos, "--mono", "--robot", "r", "--out", out};
    arguments.insert(arguments.end(), stereo_only.begin(), stereo_only.end());
    const Finished refused = run(arguments);
    EXPECT_EQ(refused.exit_code, 2) << stereo_only[0] << refused.standard_error;
    EXPECT_TRUE(says(refused, "--mono") || says(refused, stereo_only[0])) << refused.standard_error;
  }
  const std::string empty = file("empty");
  fs::create_directories(empty);
  const Finished none = run({empty, "--mono", "--robot", "r", "--out", out});
  EXPECT_EQ(none.exit_code, 1);
  EXPECT_TRUE(says(none, "NO_SUCH_FILE")) << none.standard_error;
  // Without --mono the way out is named.
  const std::string one_eye = file("one eye");
  fs::copy(photos, one_eye);
  fs::copy(drive("1") + "/calib.txt", one_eye + "/calib.txt");
  EXPECT_TRUE(says(run({"--source", "images", one_eye, "--robot", "r", "--out", out}), "--mono"));
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace relmap::testing
