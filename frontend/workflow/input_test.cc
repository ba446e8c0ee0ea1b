#include "frontend/workflow/input.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/testing/picture_files.h"
#include "proto/keyframe/keyframe_samples.h"

namespace relmap::workflow {
namespace {

TEST(Input, FollowsFromTheSourceOrFromWhatIsAtThePath) {
  const capture::testing_files::TemporaryFolder folder;
  auto writer = capture::KeyframeFileWriter::create((folder.path() / "keyframes.bin").string()).or_throw();
  ASSERT_TRUE(writer.write(KeyframeSampler(1).keyframe()).ok());
  ASSERT_TRUE(writer.close().ok());
  Logs logs;
  logs.is_log = [](const std::string& path) { return path.ends_with(".log"); };
  const auto input = [&](const std::string& source, const std::string& path, bool mono = false) {
    RunOptions options;
    options.source = source;
    options.path = path;
    options.mono = mono;
    return input_of(options, logs);
  };
  const std::string here = folder.path().string();
  EXPECT_EQ(input("auto", here), Input::kKeyframes);
  EXPECT_EQ(input("sim", here + "/keyframes.bin"), Input::kKeyframes);
  EXPECT_EQ(input("kitti", here), Input::kPairs);
  EXPECT_EQ(input("images", here, true), Input::kPhotographs);
  EXPECT_EQ(input("auto", "/a.log"), Input::kLog);
  EXPECT_EQ(input("log", "/anything"), Input::kLog);
  EXPECT_EQ(input("raw", "/a.log"), Input::kPairs);
  EXPECT_EQ(input("iidc", "7140058"), Input::kCamera);
  EXPECT_EQ(input("iidc", ""), Input::kCamera);
}

TEST(Input, NamesASessionByTheLastPartOfItsPath) {
  RunOptions options;
  for (const auto& [path, name] : {std::pair{"/data/street", "street"},
                                   {"/data/street/", "street"},
                                   {"/data/street/../lane/.", "lane"},
                                   {"drive.raw", "drive.raw"}}) {
    options.path = path;
    EXPECT_EQ(name_of_path(options), name) << path;
  }
}

}  // namespace
}  // namespace relmap::workflow
