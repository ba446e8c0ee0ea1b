#include "frontend/workflow/output_paths.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "frontend/capture/testing/picture_files.h"

namespace relmap::workflow {
namespace {

TEST(OutputPaths, AreRefusedIfTheyAreInputs) {
  const capture::testing_files::TemporaryFolder folder;
  const std::string input = (folder.path() / "keyframes.bin").string();
  capture::testing_files::write_text(input, "anything");
  std::filesystem::create_symlink(input, folder.path() / "link");
  RunOptions options;
  options.path = folder.path().string();
  options.calibration = "/calibration.yaml";
  EXPECT_TRUE(check_output_paths(options).ok()) << "there is no output at all";
  options.out = input;
  EXPECT_EQ(check_output_paths(options).to_string(),
            "INVALID_ARGUMENT: " + input + " would be written over the source");
  options.out = (folder.path() / "link").string();
  EXPECT_EQ(check_output_paths(options).reason(), Reason::INVALID_ARGUMENT) << "by another name";
  options.out = "/nowhere/../calibration.yaml";
  EXPECT_EQ(check_output_paths(options).reason(), Reason::INVALID_ARGUMENT) << "that is not there yet";
  options.out = (folder.path() / "out.bin").string();
  EXPECT_TRUE(check_output_paths(options).ok());
}

TEST(OutputPaths, AreRefusedIfTwoAreTheSame) {
  RunOptions options;
  options.path = "/street";
  options.report = "/tmp/./pairs";
  options.show = "/tmp/pairs";
  EXPECT_EQ(check_output_paths(options).to_string(), "INVALID_ARGUMENT: /tmp/./pairs is to be written twice");
}

}  // namespace
}  // namespace relmap::workflow
