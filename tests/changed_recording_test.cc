// relmap ingest of recordings that have changed since their sessions were made, and of files that are passed over.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <thread>

#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/testing/picture_files.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kPairs = 24;

class ChangedRecording : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { recorded_ = new storage::TemporaryFolder(); }
  static void TearDownTestSuite() {
    delete recorded_;
    recorded_ = nullptr;
  }
  void SetUp() override {
    setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
    options_.data = folder_ / "map";
    daemon_ = std::make_unique<RunningDaemon>(options_);
  }

  // The recording of that name; made when it is first asked for.
  static std::string recorded(const std::string& name) {
    const std::string folder = *recorded_ / name;
    if (!fs::exists(folder))
      record_simulation(folder, {"--seed", name == "drive" ? "3" : "4", "--pairs", std::to_string(kPairs), "--laps",
                                 "0.1", "--width", "320"});
    return folder;
  }
  std::string file(const std::string& name) const { return folder_ / name; }
  // Puts the recording `which` at `name`, in place of what is there.
  std::string put(const std::string& which, const std::string& name) const {
    fs::remove_all(file(name));
    fs::create_directories(fs::path(file(name)).parent_path());
    fs::copy(recorded(which), file(name), fs::copy_options::recursive);
    return file(name);
  }
  void remove_pairs(const std::string& drive, int first) const {
    for (int pair = first; pair < kPairs; ++pair)
      for (const char* eye : {"/image_0/", "/image_1/"}) fs::remove(drive + eye + picture_name(pair));
    std::string lines, line;
    std::ifstream times(drive + "/times.txt");
    for (int pair = 0; pair < first && std::getline(times, line); ++pair) lines += line + '\n';
    std::ofstream(drive + "/times.txt") << lines;
  }
  // The pictures of one eye, every second one, so that others can be put between them.
  std::string photographs(const std::string& name) const {
    fs::create_directories(file(name));
    for (int pair = 0; pair < kPairs; pair += 2)
      fs::copy_file(recorded("drive") + "/image_0/" + picture_name(pair), file(name) + "/" + picture_name(pair));
    return file(name);
  }
  void add_photograph(const std::string& folder, int pair) const {
    fs::copy_file(recorded("drive") + "/image_0/" + picture_name(pair), folder + "/" + picture_name(pair));
  }

  std::vector<std::string> command(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {built_program("relmap"), "--server", options_.data, "ingest"});
    return arguments;
  }
  Finished ingest(const std::vector<std::string>& arguments) const { return run_program(command(arguments)); }
  std::vector<client::Session> sessions() const { return daemon_->client()->sessions().or_throw(); }
  // Ends the command by a signal once the newest session has a frame.
  void interrupt(const std::vector<std::string>& arguments) const {
    const std::size_t before = sessions().size();
    Process batch(command(arguments), {});
    const auto begun = [&] {
      const auto all = sessions();
      return all.size() > before && all.back().frames > 0;
    };
    while (batch.running() && !begun()) std::this_thread::sleep_for(milliseconds(1));
    batch.signal(SIGTERM);
    const auto code = batch.wait(kPatience);
    ASSERT_TRUE(code);
    ASSERT_EQ(*code, 1) << "it was over too soon to be interrupted";
  }

  static inline storage::TemporaryFolder* recorded_ = nullptr;
  const storage::TemporaryFolder folder_;
  DaemonOptions options_;
  std::unique_ptr<RunningDaemon> daemon_;
};

TEST_F(ChangedRecording, IsRefusedByNameAndTheOthersGoOn) {
  const std::string drive = put("drive", "drives/a");
  remove_pairs(drive, 16);
  ASSERT_EQ(ingest({drive}).exit_code, 0);

  // It grew; another one of the same command is taken in all the same.
  put("drive", "drives/a");
  const std::string other = put("another", "drives/b");
  const Finished grown = ingest({drive, other});
  EXPECT_EQ(grown.exit_code, 1) << grown.standard_output;
  EXPECT_THAT(grown.standard_output, AllOf(HasSubstr("SEQUENCE_CONFLICT: session 1 is made of 16 pairs, and there are "
                                                     "24 now; --again takes it in as a new session"),
                                           HasSubstr("relmap session delete 1")));
  EXPECT_EQ(sessions().size(), 2u);
  EXPECT_EQ(sessions()[1].state, client::SessionState::kEnded);

  // It shrank, by lines of its times and by pictures.
  remove_pairs(drive, 12);
  EXPECT_THAT(ingest({drive}).standard_output, HasSubstr("16 pairs, and there are 12 now"));
  // The original content, with new files.
  put("drive", "drives/a");
  remove_pairs(drive, 16);
  const Finished same = ingest({drive, other});
  EXPECT_EQ(same.exit_code, 0) << same.standard_output;
}

TEST_F(ChangedRecording, IsRefusedWhenItsCalibrationWasCorrected) {
  const std::string drive = put("drive", "drives/a");
  remove_pairs(drive, 16);
  ASSERT_EQ(ingest({drive}).exit_code, 0);
  // The baseline by a hundredth.
  std::istringstream calibration(read_text(drive + "/calib.txt"));
  std::ostringstream written;
  for (std::string line; std::getline(calibration, line);) {
    std::istringstream words(line);
    std::string word, all;
    for (int i = 0; words >> word; ++i)
      all += (i > 0 ? " " : "") + (line.starts_with("P1:") && i == 4 ? std::to_string(1.01 * std::stod(word)) : word);
    written << all << '\n';
  }
  std::ofstream(drive + "/calib.txt") << written.str();
  const Finished corrected = ingest({drive});
  EXPECT_EQ(corrected.exit_code, 1);
  EXPECT_THAT(corrected.standard_output, HasSubstr("session 1 is made with another calibration (focal length"));
  const Finished named = ingest({drive, "--calibration", drive + "/calib.txt"});
  EXPECT_THAT(named.standard_output, Not(HasSubstr("session 1"))) << "what is named is another recording";
}

TEST_F(ChangedRecording, IsRefusedAndTakenInAgainWhereAnotherLiesInItsPlace) {
  const std::string drive = put("drive", "drives/a");
  remove_pairs(drive, 16);
  ASSERT_EQ(ingest({drive}).exit_code, 0);
  // Of as many pairs.
  put("another", "drives/a");
  remove_pairs(drive, 16);
  const Finished another = ingest({drive});
  EXPECT_EQ(another.exit_code, 1);
  EXPECT_THAT(another.standard_output, HasSubstr("session 1 is made of another recording"));

  // The advised command works, but makes only one new session.
  const std::size_t before = sessions().size();
  const Finished again = ingest({drive, "--again"});
  EXPECT_EQ(again.exit_code, 0) << again.standard_output;
  EXPECT_EQ(sessions().size(), before + 1);
  const Finished there = ingest({drive});
  EXPECT_EQ(there.exit_code, 0) << there.standard_output;
  EXPECT_THAT(there.standard_output, HasSubstr("was there"));
  EXPECT_EQ(sessions().size(), before + 1);
  // From now on it is compared with what was taken in last.
  remove_pairs(drive, 12);
  const Finished shrunk = ingest({drive});
  EXPECT_EQ(shrunk.exit_code, 1);
  EXPECT_THAT(shrunk.standard_output, HasSubstr("session 2 is made of 16 pairs, and there are 12 now"));
  fs::remove_all(drive + "/image_0");
  const Finished gone = ingest({drive});
  EXPECT_EQ(gone.exit_code, 1) << gone.standard_output;
  EXPECT_THAT(gone.standard_output, AllOf(HasSubstr(" failed "), HasSubstr("NO_SUCH_FILE")));
}

TEST_F(ChangedRecording, OfKeyframesIsRefusedToo) {
  const std::string k = file("k.bin");
  const auto write = [&](const std::string& drive, const std::string& session) {
    const Finished done = run_program(
        {built_program("relmap-frontend"), recorded(drive), "--robot", "cart", "--session", session, "--out", k});
    ASSERT_EQ(done.exit_code, 0) << done.standard_error;
  };
  write("drive", "morning");
  const Finished first = ingest({k});
  EXPECT_EQ(first.exit_code, 0) << first.standard_error;
  ASSERT_EQ(sessions().size(), 1u);
  EXPECT_EQ(sessions()[0].robot, "cart") << "as it is recorded";
  EXPECT_EQ(sessions()[0].name, "morning");
  EXPECT_EQ(ingest({k}).exit_code, 0);
  write("another", "noon");
  const Finished another = ingest({k});
  EXPECT_EQ(another.exit_code, 1);
  EXPECT_THAT(another.standard_output, HasSubstr("session 1 is made of another recording of "));
  EXPECT_EQ(ingest({k, "--again", "--robot", "truck"}).exit_code, 0);
  ASSERT_EQ(sessions().size(), 2u);
  EXPECT_EQ(sessions()[1].robot, "truck") << "what is said wins";
  EXPECT_EQ(sessions()[1].name, "noon");
}

// A photograph that is added between others shifts those after it: keyframes that the map has would not be sent again,
// and the others would be appended to the wrong ones.
TEST_F(ChangedRecording, IsRefusedThoughItWasInterrupted) {
  const std::string photos = photographs("photos/tower");
  ASSERT_NO_FATAL_FAILURE(interrupt({"--mono", photos}));
  add_photograph(photos, 1);
  const Finished changed = ingest({"--mono", photos});
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_THAT(changed.standard_output, HasSubstr("session 1 is made of 12 pictures, and there are 13 now"));
  fs::remove(photos + "/" + picture_name(1));
  const Finished same = ingest({"--mono", photos});
  EXPECT_EQ(same.exit_code, 0) << same.standard_output;
  ASSERT_EQ(sessions().size(), 1u);
  EXPECT_EQ(sessions()[0].frames, 12u);

  // --again goes on with its session, and begins another where that is made of something else.
  ASSERT_NO_FATAL_FAILURE(interrupt({"--mono", photos, "--again"}));
  const Finished goes_on = ingest({"--mono", photos, "--again"});
  EXPECT_EQ(goes_on.exit_code, 0) << goes_on.standard_output;
  ASSERT_EQ(sessions().size(), 2u);
  ASSERT_NO_FATAL_FAILURE(interrupt({"--mono", photos, "--again"}));
  add_photograph(photos, 1);
  const Finished anew = ingest({"--mono", photos, "--again"});
  EXPECT_EQ(anew.exit_code, 0) << anew.standard_output;
  EXPECT_THAT(anew.standard_error, AllOf(HasSubstr("session 3 is made of 12 pictures, and there are 13 now"),
                                         HasSubstr("relmap session delete 3")));
  ASSERT_EQ(sessions().size(), 4u);
  EXPECT_EQ(sessions()[3].frames, 13u);
}

TEST_F(ChangedRecording, AnAgainWhoseSessionWasDeletedMakesAnotherOne) {
  const std::string photos = photographs("photos/tower");
  ASSERT_NO_FATAL_FAILURE(interrupt({"--mono", photos, "--again"}));
  ASSERT_EQ(
      run_program({built_program("relmap"), "--server", options_.data, "session", "delete", "1", "--yes"}).exit_code,
      0);
  ASSERT_TRUE(daemon_->client()->wait_idle().ok());
  const Finished deleted = ingest({"--mono", photos, "--again"});
  EXPECT_EQ(deleted.exit_code, 1);
  EXPECT_THAT(deleted.standard_output, HasSubstr("the same command takes it in as another new session"));
  const Finished anew = ingest({"--mono", photos, "--again"});
  EXPECT_EQ(anew.exit_code, 0) << anew.standard_output;
}

TEST_F(ChangedRecording, RefusedKeyframesGiveExitCodeThree) {
  const std::string k = file("k.bin");
  ASSERT_EQ(run_program({built_program("relmap-frontend"), recorded("drive"), "--robot", "cart", "--session", "morning",
                         "--all-keyframes", "--out", k})
                .exit_code,
            0);
  std::vector<Keyframe> keyframes;
  auto reader = capture::KeyframeFileReader::open(k).or_throw();
  for (auto keyframe = reader.next().or_throw(); keyframe; keyframe = reader.next().or_throw())
    keyframes.push_back(std::move(*keyframe));
  ASSERT_EQ(keyframes.size(), static_cast<std::size_t>(kPairs));
  const auto write = [&](const std::string& path) {
    auto writer = capture::KeyframeFileWriter::create(path).or_throw();
    for (const Keyframe& keyframe : keyframes) ASSERT_TRUE(writer.write(keyframe).ok());
    ASSERT_TRUE(writer.close().ok());
  };
  // Keyframes that the recording itself lacks do not count as lost by the map.
  keyframes.erase(keyframes.begin() + 5, keyframes.begin() + 8);
  ASSERT_NO_FATAL_FAILURE(write(file("gaps.bin")));
  const Finished gaps = ingest({file("gaps.bin")});
  EXPECT_EQ(gaps.exit_code, 0) << gaps.standard_output;
  EXPECT_THAT(gaps.standard_output, HasSubstr("the recording lacks 3 keyframes"));
  EXPECT_EQ(ingest({file("gaps.bin")}).exit_code, 0);

  keyframes[10].time_us = keyframes[2].time_us;
  ASSERT_NO_FATAL_FAILURE(write(file("refused.bin")));
  const Finished refused = ingest({file("gaps.bin"), file("refused.bin")});
  EXPECT_EQ(refused.exit_code, 3) << refused.standard_output;
  EXPECT_THAT(refused.standard_output, HasSubstr("1 of 21 keyframes was refused: 1 TIME_BACKWARDS"));
  const Finished later = ingest({file("refused.bin")});
  EXPECT_EQ(later.exit_code, 3) << "it is as little there as before: " << later.standard_output;
  // A recording that fails goes before it.
  fs::create_directories(file("empty"));
  EXPECT_EQ(ingest({file("refused.bin"), file("empty")}).exit_code, 1);
}

// Two sizes, one of them with two lenses; all of it is in the map, and once only.
TEST_F(ChangedRecording, PhotographsOfThreeCamerasAreASessionForEach) {
  const std::string photos = file("photos/tower");
  fs::create_directories(photos);
  const std::vector<std::pair<std::string, std::uint32_t>> cameras{
      {"320x240-24mm", 5}, {"320x240-72mm", 4}, {"384x288", 3}};
  int pair = 0;
  for (const auto& [camera, pictures] : cameras)
    for (std::uint32_t i = 0; i < pictures; ++i, pair += 2) {
      cv::Mat picture = cv::imread(recorded("drive") + "/image_0/" + picture_name(pair), cv::IMREAD_GRAYSCALE);
      ASSERT_EQ(picture.size(), cv::Size(320, 240));
      if (camera == "384x288") cv::resize(picture, picture, {384, 288});
      Bytes jpeg;
      ASSERT_TRUE(cv::imencode(".jpg", picture, jpeg));
      const bool wide = camera.ends_with("24mm"), of_lens = camera.ends_with("mm");
      std::ofstream(photos + "/" + std::to_string(pair) + ".jpg")
          << (of_lens ? capture::testing_files::with_focal_length(jpeg, wide ? 24 : 72)
                      : std::string(jpeg.begin(), jpeg.end()));
    }

  const Finished done = ingest({"--mono", photos});
  EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  std::map<std::string, std::uint32_t> taken_in;
  for (const client::Session& session : sessions()) taken_in[session.name] += session.frames;
  EXPECT_THAT(taken_in, ::testing::ElementsAre(::testing::Pair("photos/tower 320x240-24mm", 5u),
                                               ::testing::Pair("photos/tower 320x240-72mm", 4u),
                                               ::testing::Pair("photos/tower 384x288", 3u)));
  const Finished again = ingest({"--mono", photos});
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  for (const auto& [camera, pictures] : cameras)
    EXPECT_THAT(again.standard_output, ::testing::ContainsRegex(camera + " [^\n]*was there"));
  ASSERT_EQ(sessions().size(), cameras.size());
  for (const client::Session& session : sessions()) EXPECT_EQ(session.frames, taken_in[session.name]) << session.name;
}

TEST_F(ChangedRecording, PhotographsThatAreNotTakenInAreNamed) {
  const std::string photos = photographs("photos/tower");
  for (const char* bad : {"a.jpg", "b.jpg", "c.png", "d.png"}) std::ofstream(photos + "/" + bad) << "no picture";
  for (const char* other : {"film.mov", "x.heic"}) std::ofstream(photos + "/" + other) << "no picture";
  const std::string north = photographs("photos/tower/north");
  const Finished done = ingest({"--mono", photos});
  EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  EXPECT_THAT(done.standard_error,
              HasSubstr("1 folder in it is passed over; each is a recording of its own: " + north));
  EXPECT_THAT(done.standard_error, HasSubstr("2 files are passed over, neither PNG nor JPEG nor PGM: film.mov x.heic"));
  EXPECT_THAT(done.standard_output,
              HasSubstr("left out:\n  a.jpg: neither PNG nor JPEG nor binary PGM (NOT_A_PICTURE)\n"));
  EXPECT_THAT(done.standard_output, HasSubstr("and 1 more"));
  const Finished of_north = ingest({"--mono", north});
  EXPECT_EQ(of_north.exit_code, 0) << of_north.standard_error;
  for (const auto& entry : fs::directory_iterator(north)) std::ofstream(entry.path()) << "no picture any more";
  const Finished spoiled = ingest({"--mono", north});
  EXPECT_EQ(spoiled.exit_code, 1) << "none of them can be read: " << spoiled.standard_output;
  auto json = command({"--mono", photos});
  json.insert(json.begin() + 3, "--json");
  const Finished again = run_program(json);
  for (const char* said : {"/a.jpg: neither", "/b.jpg: neither", "/c.png: neither", "/d.png: neither",
                           "\"folders_passed_over\":[\"north\"]", "\"files_passed_over\":[\"film.mov\",\"x.heic\"]"})
    EXPECT_THAT(again.standard_output, HasSubstr(said));
}

}  // namespace
}  // namespace relmap::testing
