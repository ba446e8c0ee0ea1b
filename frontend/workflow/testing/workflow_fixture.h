// A run with a fake outside, for tests of workflows.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "frontend/capture/testing/picture_files.h"
#include "frontend/console.h"
#include "frontend/workflow/exit_code.h"
#include "frontend/workflow/outside.h"
#include "frontend/workflow/run.h"
#include "frontend/workflow/run_options.h"
#include "frontend/workflow/testing/fake_daemon.h"
#include "frontend/workflow/testing/fake_pairs.h"

namespace relmap::workflow {

class WorkflowTest : public ::testing::Test {
 protected:
  WorkflowTest() {
    options_.robot = "cart";
    options_.path = "/nowhere/street";
    options_.quiet = true;
    options_.patience_s = 7;
    options_.picture = tracking::KeyframePicture::kNone;  // ThreadSanitizer finds a wrong order in GDAL's locks
    outside_.open_daemon_sink = daemon_.opener();
    outside_.open_pairs = [this](const RunOptions&) -> Result<std::unique_ptr<capture::StereoSource>> {
      if (!no_recording_.ok()) return no_recording_;
      // Every second source is for the check of the stereo camera, to which `before` does not apply.
      testing_pairs::Script script = script_;
      if (++readers_ % 2 == 0) script.before = [](std::size_t) {};
      return std::unique_ptr<capture::StereoSource>(std::make_unique<testing_pairs::FakePairs<>>(script));
    };
    waits_.look = std::chrono::milliseconds(2);
    waits_.camera = std::chrono::milliseconds(4);
    waits_.news_silence = std::chrono::milliseconds(1);
  }

  // Runs a workflow as run_frontend() does. Afterwards said_ is what it wrote on standard error.
  template <typename Workflow>
  Status run(const Workflow& workflow) {
    ::testing::internal::CaptureStderr();
    workflow::Run run(options_, outside_, stop_, summary_, waits_);
    const Status status = workflow(run);
    summary_.left_out = run.refusals.all();
    summary_.interrupted = stop_;
    summary_.failure = status;
    said_ = ::testing::internal::GetCapturedStderr();
    return status;
  }
  ExitCode exit_code() const { return exit_code_of(summary_.failure, summary_); }

  static SessionHeader session_called(const std::string& name) {
    SessionHeader header;
    header.name = name;
    header.camera = testing_pairs::kDriveCamera;
    return header;
  }

  // The path of a file in the test's temporary folder.
  std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  static std::vector<std::string> lines_of(const std::string& path) {
    std::vector<std::string> lines;
    std::ifstream in(path);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }

  capture::testing_files::TemporaryFolder folder_;
  testing_daemon::FakeDaemon daemon_;
  testing_pairs::Script script_;
  Status no_recording_;  // if not ok, why the recording cannot be opened
  int readers_ = 0;      // times that the recording was opened
  RunOptions options_;
  Outside outside_;
  Waits waits_;
  std::atomic<bool> stop_ = false;
  frontend::RunSummary summary_;
  std::string said_;
};

}  // namespace relmap::workflow
