#include "tools/relmap/cli.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <sstream>
#include <utility>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"
#include "tools/relmap/eye_names.h"
#include "tools/relmap/picture_file.h"

namespace relmap::cli {
namespace {

struct Ran {
  int code;
  std::string out, err;
};

Ran run_with(std::initializer_list<const char*> arguments) {
  std::vector<const char*> argv = {"relmap"};
  argv.insert(argv.end(), arguments);
  std::ostringstream out, err;
  const int code = run(static_cast<int>(argv.size()), argv.data(), out, err);
  return {code, out.str(), err.str()};
}

TEST(Cli, HelpIsDataAndSucceeds) {
  const Ran ran = run_with({"--help"});
  EXPECT_EQ(ran.code, kOk);
  EXPECT_NE(ran.out.find("Examples:"), std::string::npos);
  EXPECT_EQ(ran.err, "");
}

// Whoever asks for a command's help sees how it is used.
TEST(Cli, TheHelpOfEachCommandHasExamplesOfIt) {
  const std::vector<std::vector<const char*>> commands{{"status"},
                                                       {"top"},
                                                       {"watch"},
                                                       {"sessions"},
                                                       {"session"},
                                                       {"session", "freeze"},
                                                       {"session", "thaw"},
                                                       {"frame"},
                                                       {"session", "delete"},
                                                       {"transform"},
                                                       {"localise"},
                                                       {"match"},
                                                       {"route"},
                                                       {"label"},
                                                       {"labels"},
                                                       {"edges"},
                                                       {"edge"},
                                                       {"edge", "remove"},
                                                       {"edge", "restore"},
                                                       {"edge", "accept"},
                                                       {"edge", "withdraw"},
                                                       {"edge", "propose"},
                                                       {"import"},
                                                       {"import", "g2o"},
                                                       {"ingest"},
                                                       {"export"},
                                                       {"map"},
                                                       {"report"},
                                                       {"wait"}};
  for (const std::vector<const char*>& words : commands) {
    std::vector<const char*> argv{"relmap"};
    argv.insert(argv.end(), words.begin(), words.end());
    argv.push_back("--help");
    std::ostringstream out, err;
    EXPECT_EQ(run(static_cast<int>(argv.size()), argv.data(), out, err), kOk);
    std::string example = "\n  relmap";
    for (const char* word : words) example += std::string(" ") + word;
    EXPECT_NE(out.str().find(example), std::string::npos) << example << '\n' << out.str();
  }
}

TEST(Cli, AMistypedCommandGetsASuggestionAndTheVersionIsPrinted) {
  const Ran slip = run_with({"--server", "/tmp", "edge", "remov", "1:2/3"});
  EXPECT_EQ(slip.code, kUsage);
  EXPECT_TRUE(slip.err.starts_with("relmap edge has no command 'remov'. Did you mean remove?")) << slip.err;
  const Ran option = run_with({"--server", "/tmp", "route", "--form", "1:0", "--to", "dock"});
  EXPECT_TRUE(option.err.starts_with("relmap route has no option '--form'. Did you mean --from")) << option.err;
  const Ran version = run_with({"--version"});
  EXPECT_EQ(version.code, kOk);
  EXPECT_NE(version.out, "");
}

TEST(Cli, WrongUsageIsToldApart) {
  for (const auto& arguments :
       std::vector<std::vector<const char*>>{{},
                                             {"--server", "/tmp"},
                                             {"--server", "/tmp", "fly"},
                                             {"--server", "/tmp", "route", "--from", "1:0"},
                                             {"--server", "/tmp", "route", "--from", "a", "--to", "b", "--by", "air"},
                                             {"--server", "/tmp", "edges", "--state", "odd"},
                                             {"--server", "no/such/folder", "status"}}) {
    std::vector<const char*> argv = {"relmap"};
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    std::ostringstream out, err;
    EXPECT_EQ(run(static_cast<int>(argv.size()), argv.data(), out, err), kUsage) << err.str();
    EXPECT_EQ(out.str(), "");
    EXPECT_NE(err.str(), "");
  }
}

// Whoever mistypes an id is told so at once: no daemon is needed, and none is asked.
TEST(Cli, AMalformedIdIsWrongUsage) {
  using Words = std::vector<const char*>;
  const std::vector<std::pair<Words, const char*>> cases{
      {{"frame", "abc"}, "ID: 'abc' is no frame; a frame is written session:index, as 3:120\n"},
      {{"transform", "1:2", "3"}, "B: '3' is no frame"},
      {{"localise", "p.png", "--near", "1:"}, "--near: '1:' is no frame"},
      {{"match", "p.png", "--near", "x"}, "--near: 'x' is no frame"},
      {{"edges", "--explain", "6:x"}, "--explain: '6:x' is no edge; an edge is written session:index/ordinal"},
      {{"edges", "--frame", "6"}, "--frame: '6' is no frame"},
      {{"edges", "--near", "6"}, "--near: '6' is no frame"},
      {{"edges", "--since", "yesterday"}, "--since: 'yesterday' is no time"},
      {{"edges", "--until", "12"}, "--until: '12' is no time"},
      {{"edge", "remove", "3:4"}, "ID: '3:4' is no edge"},
      {{"edge", "restore", "3:4"}, "ID: '3:4' is no edge"},
      {{"edge", "accept", "3:4"}, "ID: '3:4' is no edge"},
      {{"edge", "withdraw", "3:4"}, "ID: '3:4' is no edge"},
      {{"edge", "propose", "3:4", "here"}, "B: 'here' is no frame"},
      {{"export", "--root", "1"}, "--root: '1' is no frame"},
      {{"route", "--from", "1:0", "--to", "dock", "--weigh", "metre=1,mile=2"}, "--weigh: 'mile=2' is no weight"},
  };
  for (const auto& [words, said] : cases) {
    std::vector<const char*> argv = {"relmap", "--server", RELMAP_SOURCE_DIR};
    argv.insert(argv.end(), words.begin(), words.end());
    std::ostringstream out, err;
    EXPECT_EQ(run(static_cast<int>(argv.size()), argv.data(), out, err), kUsage) << said;
    EXPECT_TRUE(err.str().starts_with(said)) << err.str();
    EXPECT_EQ(out.str(), "");
  }
  EXPECT_EQ(run_with({"--server", RELMAP_SOURCE_DIR, "frame", "3:120"}).code, kUnreachable);
  EXPECT_EQ(run_with({"--server", RELMAP_SOURCE_DIR, "edges", "--explain", "6:1/2"}).code, kUnreachable);
  EXPECT_EQ(run_with({"--server", RELMAP_SOURCE_DIR, "edges", "--since", "2h"}).code, kUnreachable);
}

TEST(Cli, WithJsonEveryCommandTellsItsFailureAsADocument) {
  for (const char* command : {"status", "sessions", "labels", "edges", "wait", "watch"}) {
    const Ran ran = run_with({"--server", RELMAP_SOURCE_DIR, "--json", command});
    EXPECT_EQ(ran.code, kUnreachable) << command;
    EXPECT_TRUE(ran.out.starts_with(R"({"error":{"reason":"UNREACHABLE","message":")")) << command << ran.out;
    EXPECT_EQ(std::count(ran.out.begin(), ran.out.end(), '\n'), 1) << ran.out;
    EXPECT_TRUE(ran.err.starts_with("UNREACHABLE: ")) << ran.err;
  }
}

TEST(Cli, WatchSaysWhatTheLogHasNot) {
  const Ran ran = run_with({"watch", "--help"});
  EXPECT_NE(ran.out.find("Robots and the disk are not in this log"), std::string::npos) << ran.out;
  EXPECT_NE(ran.out.find("--from oldest, --resume and --state bring back none of them"), std::string::npos) << ran.out;
}

TEST(Cli, AWordInPlaceOfANumberIsReported) {
  const Ran word = run_with({"--server", "/tmp", "edge", "remove", "1:2/3", "--shown", "x"});
  EXPECT_EQ(word.code, kUsage);
  EXPECT_TRUE(word.err.starts_with("--shown: 'x' is not a number\n")) << word.err;
  const Ran outside = run_with({"--server", "/tmp", "ingest", "drive", "--patience", "-1"});
  EXPECT_TRUE(outside.err.starts_with("--patience: Value -1 not in range 0 to 86400\n")) << outside.err;
}

TEST(Cli, ANumberWithoutAnUpperBoundIsNotRefusedWithHundredsOfDigits) {
  const Ran none = run_with({"--server", "/tmp", "edges", "--limit", "0"});
  EXPECT_EQ(none.code, kUsage);
  EXPECT_EQ(none.err, "--limit: Value 0 must be greater than 0\nRun relmap edges --help for more information.\n");
  const Ran negative = run_with({"--server", "/tmp", "route", "--from", "1:0", "--to", "dock", "--max-cost", "-0.5"});
  EXPECT_TRUE(negative.err.starts_with("--max-cost: Value -0.5 must not be negative\n")) << negative.err;
}

TEST(Cli, SaysThatNoDaemonAnswers) {
  const Ran ran = run_with({"--server", RELMAP_SOURCE_DIR, "status"});
  EXPECT_EQ(ran.code, kUnreachable);
  EXPECT_EQ(ran.out, "");
  EXPECT_TRUE(ran.err.starts_with("UNREACHABLE: ")) << ran.err;
}

TEST(ExitCode, FollowsTheReason) {
  EXPECT_EQ(exit_code({}), kOk);
  EXPECT_EQ(exit_code({Reason::NEW_PLACE, "x"}), kNegativeAnswer);
  EXPECT_EQ(exit_code({Reason::UNREACHABLE, "x"}), kUnreachable);
}

TEST(EyeNames, FoldersOfDataSetsTakePrecedenceOverAPicturesName) {
  for (const char* right : {"mav0/cam1/data/1403715.png", "image_1/000001.png", "image_1/door_left.png",
                            "2011_09_26/image_03/data/0000000001.png", "drive/right/7.jpg", "Right.png",
                            "photos/front_right.png", "cam1.png"})
    EXPECT_EQ(eye_of_picture(right), Eye::kRight) << right;
  for (const char* left : {"mav0/cam0/data/1.png", "mav0/cam0/data/door_right.png", "cam0/door_right.png",
                           "image_0/1.png", "image_02/data/1.png", "left/door_right.png", "left.png"})
    EXPECT_EQ(eye_of_picture(left), Eye::kLeft) << left;
  for (const char* neither : {"photos/bright.jpg", "cam10/1.png", "image_4/1.png", "photos/image_1.png",
                              "a/b/right/c/d/1.png", "right/photos/1.png", "lobby_right/1.png", "cam1/a/b/1.png"})
    EXPECT_EQ(eye_of_picture(neither), Eye::kNotSaid) << neither;
}

TEST(EyeNames, ACalibrationIsJudgedByItsNameAndItsFolder) {
  const storage::TemporaryFolder folder;
  const std::string in_folder = folder / "right";
  std::filesystem::create_directories(in_folder + "/robot");
  for (const std::string& right :
       {std::string("cam1/sensor.yaml"), std::string("cam1_sensor.yaml"), std::string("x/front_right.yaml"),
        std::string("right/calib.yaml"), in_folder, in_folder + "/"})
    EXPECT_EQ(eye_of_calibration(right), Eye::kRight) << right;
  for (const char* left : {"cam0/sensor.yaml", "front_left.yaml", "cam0/front_right.yaml"})
    EXPECT_EQ(eye_of_calibration(left), Eye::kLeft) << left;
  for (const std::string& neither : {std::string("calib.txt"), std::string("right/robot/calib.txt"),
                                     std::string("cam1/robot/calib.txt"), in_folder + "/robot"})
    EXPECT_EQ(eye_of_calibration(neither), Eye::kNotSaid) << neither;
}

TEST(PictureFile, SizeIsReadFromTheHeader) {
  const std::string png("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x04\xda\0\0\x01\x77", 24);
  const auto size = pixel_size(png);
  ASSERT_TRUE(size.ok());
  EXPECT_EQ(size->width, 1242);
  EXPECT_EQ(size->height, 375);
  // Start, a comment of 4 bytes, a fill byte, and the frame: precision, height, width.
  const std::string jpeg("\xff\xd8\xff\xfe\0\x04hi\xff\xff\xc0\0\x11\x08\x01\x77\x04\xda", 18);
  const auto jpeg_size = pixel_size(jpeg);
  ASSERT_TRUE(jpeg_size.ok()) << jpeg_size.status().to_string();
  EXPECT_EQ(jpeg_size->width, 1242);
  EXPECT_EQ(jpeg_size->height, 375);
}

TEST(PictureFile, ThumbnailsAreWrittenOrTheErrorIsReported) {
  const storage::TemporaryFolder folder;
  client::PlaceMatch place;
  place.frame = {3, 120};
  place.thumbnail = "a small picture";
  const std::vector<client::PlaceMatch> places{place};
  ASSERT_TRUE(write_thumbnails(places, folder / "a/b").ok());
  EXPECT_EQ(read_picture_file(folder / "a/b/3-120.jpg").or_throw(), place.thumbnail);

  const std::string in_the_way = folder / "a/b/3-120.jpg/c";
  for (const auto& some : {places, {}}) {
    const Status status = write_thumbnails(some, in_the_way);
    EXPECT_EQ(status.reason(), Reason::IO_ERROR);
    EXPECT_NE(status.message().find("cannot make the folder " + in_the_way), std::string::npos) << status.message();
  }
}

TEST(PictureFile, WhatIsNoPictureIsNamed) {
  EXPECT_EQ(pixel_size("hello").reason(), Reason::NOT_A_PICTURE);
  EXPECT_EQ(pixel_size("\xff\xd8").reason(), Reason::PICTURE_DAMAGED);
  EXPECT_EQ(pixel_size(std::string("\xff\xd8\xff\xe0\0\0\0\0\0\0", 10)).reason(), Reason::PICTURE_DAMAGED);
  EXPECT_EQ(pixel_size("\x89PNG\r\n\x1a\n").reason(), Reason::PICTURE_DAMAGED);
  EXPECT_EQ(read_picture_file("/no/such.png").reason(), Reason::NO_SUCH_FILE);
  const storage::TemporaryFolder folder;
  EXPECT_EQ(read_picture_file(folder / "").status().to_string(),
            "NOT_A_PICTURE: " + (folder / "") + " is a folder; give one of the pictures in it, a JPEG or PNG file");
}

}  // namespace
}  // namespace relmap::cli
