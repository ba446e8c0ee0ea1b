#include "frontend/workflow/exit_code.h"

#include <gtest/gtest.h>

namespace relmap::workflow {
namespace {

TEST(ExitCode, IsThatOfTheMostSeriousOutcome) {
  frontend::RunSummary summary;
  EXPECT_EQ(exit_code_of({}, summary), 0);
  summary.expected = 10;
  summary.measured = 7;
  EXPECT_EQ(exit_code_of({}, summary), 5) << "not to be trusted";
  summary.publishing.gaps = 1;
  EXPECT_EQ(exit_code_of({}, summary), 3) << "given up";
  summary.publishing = {};
  summary.publishing.refused[Reason::CORRUPT] = 1;
  EXPECT_EQ(exit_code_of({}, summary), 3) << "refused";
  summary.publishing = {};
  summary.publishing.unsettled = 1;
  EXPECT_EQ(exit_code_of({}, summary), 3) << "left";
  summary.interrupted = true;
  EXPECT_EQ(exit_code_of({}, summary), 4);
  EXPECT_EQ(exit_code_of({Reason::IO_ERROR, ""}, summary), 1);
  for (const Reason usage : {Reason::INVALID_ARGUMENT, Reason::NO_SUCH_SESSION, Reason::BAD_NAME})
    EXPECT_EQ(exit_code_of({usage, ""}, summary), 2);
}

}  // namespace
}  // namespace relmap::workflow
