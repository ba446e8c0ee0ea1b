#include "server/map/beyond_doubt.h"

#include <gtest/gtest.h>

#include <functional>

#include "server/map/testing/ridden_drive.h"

namespace relmap::map {
namespace {

// The closure of a frame that crosses an old path: strong, and unique. The robot never stood, so it was not carried.
storage::ClosureProposalRecord crossing(const RiddenDrive& drive, std::uint32_t i) {
  storage::ClosureProposalRecord proposal = drive.as_driven(i);
  proposal.inliers = 120;
  proposal.spread = 0.45f;
  proposal.probability = 0.97f;
  proposal.uniqueness.known = true;
  proposal.uniqueness.differs = 0.1f;
  proposal.uniqueness.runner_up_inliers = 20;
  return proposal;
}

TEST(BeyondDoubt, ALoneClosureWithStrongGeometryIsAccepted) {
  RiddenDrive drive(5, 0);
  const storage::Edge closure = drive.propose(crossing(drive, kCircuit + 2));
  EXPECT_EQ(closure.state, storage::EdgeState::kAccepted);
  EXPECT_EQ(closure.reason, Reason::BEYOND_DOUBT);
}

TEST(BeyondDoubt, MissingAnyConditionItStaysALoneCandidate) {
  const std::pair<const char*, std::function<void(storage::ClosureProposalRecord&)>> wanting[] = {
      {"inliers", [](auto& p) { p.inliers = 79; }},
      {"spread", [](auto& p) { p.spread = 0.29f; }},
      {"appearance", [](auto& p) { p.probability = 0.89f; }},
      {"a camera's metres", [](auto& p) { p.verification = storage::Verification::kPnP; }},
      {"what else fits is not known", [](auto& p) { p.uniqueness = {}; }},
      {"another place is confirmed", [](auto& p) { p.uniqueness.alike = 1; }},
      {"a rival", [](auto& p) { p.uniqueness.runner_up_inliers = 37; }},
      {"it shows something else", [](auto& p) { p.uniqueness.differs = 0.26f; }},
      {"what it shows was not compared", [](auto& p) { p.uniqueness.differs = -1; }},
  };
  for (const auto& [what, change] : wanting) {
    RiddenDrive drive(5, 0);
    storage::ClosureProposalRecord proposal = crossing(drive, kCircuit + 2);
    change(proposal);
    const storage::Edge closure = drive.propose(proposal);
    EXPECT_EQ(closure.state, storage::EdgeState::kCandidate) << what;
    EXPECT_EQ(closure.reason, Reason::LONE) << what;
  }
}

TEST(BeyondDoubt, StrongGeometryDoesNotOverruleTheOdometry) {
  RiddenDrive drive(8, 0);
  storage::ClosureProposalRecord off = drive.closure(kCircuit + 2);
  const storage::ClosureProposalRecord strong = crossing(drive, kCircuit + 2);
  off.inliers = strong.inliers;
  off.uniqueness = strong.uniqueness;
  EXPECT_EQ(drive.propose(off).reason, Reason::CONTRADICTS_MOTION) << "the robot was carried there, unseen";
}

}  // namespace
}  // namespace relmap::map
