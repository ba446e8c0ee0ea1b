#include "server/map/look_alike.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/derived.h"
#include "server/map/testing/ridden_drive.h"
#include "storage/graph/digest.h"

namespace relmap::map {
namespace {

using ::testing::IsEmpty;

storage::ClosureProposalRecord seen_with(storage::ClosureProposalRecord proposal, std::uint16_t compared,
                                         std::uint16_t changed) {
  proposal.uniqueness.known = true;
  proposal.uniqueness.compared = compared;
  proposal.uniqueness.changed = changed;
  return proposal;
}

TEST(LookAlike, AFloorWithDifferencesAllAlongIsTakenBack) {
  RiddenDrive drive(kBeyond);
  std::uint32_t in_force = 0, i = kCircuit + 1;
  for (; i < kCircuit + kBeyond; ++i) {
    const storage::Edge closure = drive.propose(seen_with(drive.as_driven(i), 30, 2));
    if (closure.reason == Reason::LOOKS_ALIKE) break;
    in_force += closure.state == storage::EdgeState::kAccepted;
  }
  ASSERT_LT(i, kCircuit + kBeyond);
  EXPECT_GT(in_force, 1u) << "a few views of what is the same there, too, tell nothing";
  EXPECT_EQ(drive.map().state().closures_accepted, 0u);
  EXPECT_EQ(drive.closure_of(kCircuit + 2).state, storage::EdgeState::kQuarantined);
  EXPECT_EQ(drive.closure_of(kCircuit + 2).reason, Reason::LOOKS_ALIKE);
  storage::Edge taken_back = drive.closure_of(kCircuit + 2);
  taken_back.history.push_back({0, storage::EdgeState::kAccepted, Reason::ACCEPTED_BY_OPERATOR, {}, ""});
  EXPECT_TRUE(storage::digest_of(taken_back).looks_alike) << "whatever an operator does, the daemon's verdict stays";
  taken_back.history.push_back({0, storage::EdgeState::kAccepted, Reason::CONSISTENT, {}, ""});
  EXPECT_FALSE(storage::digest_of(taken_back).looks_alike);
  for (++i; i < kCircuit + kBeyond; ++i) EXPECT_EQ(drive.propose(drive.as_driven(i)).reason, Reason::LOOKS_ALIKE);
  EXPECT_EQ(drive.map().state().closures_accepted, 0u);
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

TEST(LookAlike, AnUnchangedPlaceIsAcceptedBehindAStop) {
  RiddenDrive drive(kBeyond);
  for (std::uint32_t i = kCircuit + 1; i < kCircuit + kBeyond; ++i)
    drive.propose(seen_with(drive.as_driven(i), 30, i % 10 == 0 ? 1 : 0));
  EXPECT_EQ(drive.map().state().closures_accepted, kBeyond - 1);
}

TEST(LookAlike, APlaceMayHaveChangedIfTheRobotDidNotStop) {
  RiddenDrive drive(kBeyond, 1);
  for (std::uint32_t i = kCircuit + 1; i < kCircuit + kBeyond; ++i) drive.propose(seen_with(drive.as_driven(i), 30, 6));
  EXPECT_EQ(drive.map().state().closures_accepted, kBeyond - 1);
  EXPECT_THAT(weigh_look_alikes(drive.map(), drive.closure_of(kCircuit + 9)).place.closures, IsEmpty());
}

TEST(LookAlike, EnoughUnchangedPartsBringARefusedStretchBack) {
  RiddenDrive drive(60);
  for (std::uint32_t i = kCircuit + 1; i < kCircuit + 26; ++i) drive.propose(seen_with(drive.as_driven(i), 40, 1));
  ASSERT_EQ(drive.closure_of(kCircuit + 25).reason, Reason::LOOKS_ALIKE);
  std::uint32_t i = kCircuit + 26;
  for (; i < kCircuit + 60; ++i)
    if (drive.propose(seen_with(drive.as_driven(i), 40, 0)).state == storage::EdgeState::kAccepted) break;
  EXPECT_EQ(i, kCircuit + 42) << "25 of 1680 are no more than 1.5 %";
  EXPECT_EQ(drive.map().state().closures_accepted, i - kCircuit);
  for (std::uint32_t k = kCircuit + 1; k <= i; ++k)
    EXPECT_EQ(drive.closure_of(k).state, storage::EdgeState::kAccepted) << k;
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

TEST(LookAlike, AStretchThatAnOperatorAcceptedStaysInForce) {
  RiddenDrive drive(kBeyond);
  for (std::uint32_t i = kCircuit + 1; i < kCircuit + 10; ++i) drive.propose(seen_with(drive.as_driven(i), 30, 2));
  const EdgeId id = drive.closure_of(kCircuit + 3).id;
  storage::SetEdgeStateRecord word{id, storage::EdgeState::kAccepted, "I was there"};
  word.decided = true;
  drive.drive().apply(word);
  EXPECT_EQ(drive.propose(seen_with(drive.as_driven(kCircuit + 10), 30, 2)).state, storage::EdgeState::kAccepted)
      << "he says that it is the place";
  for (std::uint32_t i = kCircuit + 1; i <= kCircuit + 10; ++i)
    EXPECT_EQ(drive.closure_of(i).state, storage::EdgeState::kAccepted) << i;
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

// The second stretch is a floor that looks like the first and is told apart from it. The third is the first again, and
// differs little from the second. It cannot be both.
TEST(LookAlike, OfTwoLookAlikesTheLessChangedOneIsAccepted) {
  constexpr std::uint32_t kHalts = 96;
  RiddenDrive drive(kBeyond, 20, {kHalts});
  for (std::uint32_t k = 0; k < 20; ++k) drive.propose(seen_with(drive.as_driven(55 + k, 5 + k), 30, 2));
  ASSERT_EQ(drive.closure_of(74).reason, Reason::LOOKS_ALIKE);
  for (std::uint32_t k = 0; k < 12; ++k) drive.propose(seen_with(drive.as_driven(98 + k, 75 + k), 40, k % 3 == 0));
  ASSERT_EQ(drive.closure_of(109).state, storage::EdgeState::kAccepted) << "a change of 0.8 % tells nothing";
  std::uint32_t k = 14;
  const auto second = [&] { return drive.closure_of(101).state; };
  for (; k < 30 && second() == storage::EdgeState::kAccepted; ++k)
    drive.propose(seen_with(drive.as_driven(kCircuit + k, k), 40, 0));
  EXPECT_EQ(drive.closure_of(101).reason, Reason::LOOKS_ALIKE);
  EXPECT_EQ(drive.closure_of(kCircuit + 14).state, storage::EdgeState::kAccepted);
  EXPECT_EQ(drive.closure_of(kCircuit + k - 1).state, storage::EdgeState::kAccepted);
  EXPECT_GT(k, 16u) << "not by the first";
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

}  // namespace
}  // namespace relmap::map
