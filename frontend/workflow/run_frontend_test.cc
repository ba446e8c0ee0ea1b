#include "frontend/workflow/run_frontend.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "frontend/workflow/testing/workflow_fixture.h"

namespace relmap::workflow {
namespace {

class RunFrontendTest : public WorkflowTest {
 protected:
  Status run_all() { return run_frontend(options_, outside_, stop_, summary_, waits_); }
};

TEST_F(RunFrontendTest, FillsInTheSummaryEvenIfTheRunFails) {
  ASSERT_TRUE(run_all().ok());
  EXPECT_EQ(summary_.tracked, 12u);
  EXPECT_GT(summary_.wall_s, 0);
  EXPECT_TRUE(summary_.failure.ok());
  EXPECT_FALSE(summary_.interrupted);

  summary_ = {};
  stop_ = true;
  no_recording_ = {Reason::NO_SUCH_FILE, "nowhere"};
  EXPECT_EQ(run_all().reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(summary_.failure.reason(), Reason::NO_SUCH_FILE);
  EXPECT_TRUE(summary_.interrupted);
  EXPECT_GT(summary_.wall_s, 0);
}

TEST_F(RunFrontendTest, EachInputHasItsWorkflow) {
  options_.source = "images";
  options_.mono = true;
  EXPECT_EQ(run_all().reason(), Reason::NO_SUCH_FILE) << "there are no photographs";
  options_.mono = false;
  options_.source = "log";
  outside_.logs.open = [](const std::string&, const std::string&) -> Result<Logs::Session> {
    return Status(Reason::BAD_SIZE, "nothing of relmap's");
  };
  EXPECT_EQ(run_all().reason(), Reason::BAD_SIZE);
  options_.source = "iidc";
  outside_.cameras_on = [](const std::string&) -> Result<OpenCamera> { return Status(Reason::UNSUPPORTED, "no bus"); };
  EXPECT_EQ(run_all().reason(), Reason::UNSUPPORTED);
  options_.source = "sim";
  options_.path = file("keyframes.bin");
  capture::testing_files::write_text(options_.path, "no keyframes");
  EXPECT_TRUE(run_all().ok()) << "pairs";
}

TEST_F(RunFrontendTest, OnlyALogHasSessionsToChoose) {
  options_.recorded = "morning";
  EXPECT_EQ(run_all().to_string(), "INVALID_ARGUMENT: " + options_.path + " is no log: there is no session to choose");
  EXPECT_EQ(exit_code_of(summary_.failure, summary_), kUsage);
  EXPECT_EQ(daemon_.opened.size(), 0u);
}

TEST_F(RunFrontendTest, NothingIsWrittenOverItsSource) {
  options_.to = "file";
  options_.out = options_.path;
  EXPECT_EQ(run_all().reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(readers_, 0);
}

}  // namespace
}  // namespace relmap::workflow
