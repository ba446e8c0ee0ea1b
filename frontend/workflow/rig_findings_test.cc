#include "frontend/workflow/rig_findings.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "frontend/vision/rig_check.h"

namespace relmap::workflow {
namespace {

const Status kDead{Reason::EYE_DEAD, "the left eye is black"};
const Status kApart{Reason::ROWS_APART, "3 rows apart"};
const Status kUnchecked{Reason::TOO_FEW_FEATURES, "no texture"};

frontend::RunSummary summary_with(const std::vector<Status>& findings) {
  frontend::RunSummary summary;
  summary.rig.emplace().findings = findings;
  return summary;
}

std::string told_of(const std::vector<Status>& findings, bool quiet) {
  ::testing::internal::CaptureStderr();
  tell_rig_findings(summary_with(findings), quiet);
  return ::testing::internal::GetCapturedStderr();
}

std::string advice(Reason reason) { return "; what helps: " + vision::rig_advice(reason); }

TEST(RigFindings, EachIsToldInOrderWithAdviceEvenIfQuiet) {
  const std::string told =
      "the eyes are not as the calibration says: EYE_DEAD: the left eye is black" + advice(Reason::EYE_DEAD) +
      "\nthe eyes are not as the calibration says: ROWS_APART: 3 rows apart" + advice(Reason::ROWS_APART) + "\n";
  EXPECT_EQ(told_of({kDead, kApart}, true), told);
  EXPECT_EQ(told_of({kDead, kApart}, false), told);
}

TEST(RigFindings, NothingIsToldOfARigThatAgrees) {
  EXPECT_EQ(told_of({}, false), "");
  EXPECT_EQ(told_of({}, true), "");
}

TEST(RigFindings, ARigThatCouldNotBeCheckedIsToldUnlessQuiet) {
  EXPECT_EQ(told_of({kUnchecked}, false), "the eyes could not be checked: TOO_FEW_FEATURES: no texture\n");
  EXPECT_EQ(told_of({kUnchecked}, true), "");
}

TEST(RigFindings, MissingTextureBesideAFindingIsNotToldAsUnchecked) {
  EXPECT_EQ(told_of({kDead, kUnchecked}, false), told_of({kDead}, false));
}

TEST(RigFindings, ARefusalHasTheReasonOfTheFirstAndTheAdviceOfAll) {
  const Status refusal = refusal_of_rig(summary_with({kUnchecked, kDead, kApart}));
  EXPECT_EQ(refusal.reason(), Reason::EYE_DEAD) << "that the rest could not be checked is no reason to refuse";
  EXPECT_EQ(refusal.message(), "the left eye is black" + advice(Reason::EYE_DEAD) + "; ROWS_APART: 3 rows apart" +
                                   advice(Reason::ROWS_APART) + "; --despite-check tracks it all the same");
}

}  // namespace
}  // namespace relmap::workflow
