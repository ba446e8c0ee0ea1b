#include "server/map/operator_proposal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/edge_edit.h"
#include "server/map/propose.h"
#include "server/map/testing/points_drive.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/engine/memory_engine.h"

namespace relmap::map {
namespace {

constexpr std::uint32_t kRound = 40;
constexpr FrameId kEarly{1, 4}, kLate{1, 44};  // one round apart

sim::PointsWorldOptions round_and_a_quarter() {
  sim::PointsWorldOptions options;
  options.frames = 50;
  options.frames_per_lap = kRound;
  options.speed = 0.4;  // so slow that a round takes longer than the recent past, which place recognition masks
  options.births = 20;
  options.appearance = 140;
  return options;
}

// A map of one round and a quarter, in which nothing is looked up: the only closures are those that a test proposes.
class OperatorProposals : public ::testing::Test {
 protected:
  OperatorProposals() {
    const SessionNumber session = mapper_->begin_session(world_.keyframe(0).session).or_throw();
    for (std::uint32_t i = 0; i < world_.size(); ++i) {
      storage::KeyframeRecord record = keyframe_record(world_, i);
      record.session = session;
      EXPECT_TRUE(mapper_->submit_and_wait(std::move(record)).ok());
    }
    EXPECT_TRUE(mapper_->wait_idle(soon()).ok());
  }
  // Sanitized builds take their time.
  static std::chrono::steady_clock::time_point soon() {
    return std::chrono::steady_clock::now() + std::chrono::seconds(600);
  }
  static MapperOptions without_lookup() {
    MapperOptions options;
    options.closures = false;
    return options;
  }
  Result<storage::ClosureProposalRecord> find(FrameId a, FrameId b) const {
    place::PictureCache pictures;
    return propose_closure(*mapper_->view(), mapper_->places(), pictures, a, b);
  }
  // Writes the closure between the two frames and waits until it is applied.
  std::uint64_t write(FrameId a, FrameId b, const OperatorProposal& proposal = {}) {
    const std::uint64_t sequence = write_proposal(*mapper_, find(a, b).or_throw(), proposal, soon()).or_throw();
    EXPECT_TRUE(mapper_->wait_applied(sequence, soon()).ok());
    return sequence;
  }
  std::uint64_t durable() const { return mapper_->stats().durable_sequence; }

  const sim::PointsWorld world_{round_and_a_quarter()};
  const std::unique_ptr<Mapper> mapper_ =
      Mapper::open(storage::make_memory_engine(), std::make_shared<storage::Budget>(std::size_t{256} << 20),
                   place::random_vocabulary(1000, 60, 1), without_lookup())
          .or_throw();
};

TEST_F(OperatorProposals, AProposalIsOneRecordAndIsFoundByIt) {
  const std::uint64_t before = durable();
  const std::uint64_t sequence = write(kLate, kEarly);
  EXPECT_EQ(sequence, before + 1);
  const auto closure = closure_of_record(*mapper_->view(), kEarly, kLate, sequence);
  ASSERT_TRUE(closure.has_value());
  EXPECT_EQ(closure->state, storage::EdgeState::kCandidate);
  EXPECT_FALSE(closure_of_record(*mapper_->view(), kEarly, kLate, sequence + 1).has_value());
  const auto changes = changes_of_proposal(*mapper_, *closure, sequence);
  ASSERT_TRUE(changes.has_value());
  ASSERT_EQ(changes->size(), 1u);
  EXPECT_EQ(changes->front().id, closure->id);

  EXPECT_EQ(find(kLate, kEarly).reason(), Reason::WRONG_STATE) << "the closure exists";
}

TEST_F(OperatorProposals, AnAcceptanceFollowsTheProposalAndBothAreOneChange) {
  const std::uint64_t before = durable();
  const std::uint64_t sequence = write(kEarly, kLate, {true, "I was there"});
  EXPECT_EQ(sequence, before + 2);
  const auto closure = closure_of_record(*mapper_->view(), kEarly, kLate, sequence);
  ASSERT_TRUE(closure.has_value());
  EXPECT_EQ(closure->reason, Reason::ACCEPTED_BY_OPERATOR);
  EXPECT_EQ(closure->history.back().note, "I was there");
  EXPECT_EQ(closure->history.front().journal_sequence, before + 1);
  EXPECT_EQ(closure_of_record(*mapper_->view(), kEarly, kLate, before + 1)->id, closure->id);
  const auto changes = changes_of_proposal(*mapper_, *closure, sequence);
  ASSERT_TRUE(changes.has_value());
  ASSERT_EQ(changes->size(), 1u);
  EXPECT_FALSE(changes->front().before);
  EXPECT_EQ(changes->front().after->state, storage::EdgeState::kAccepted);
}

TEST_F(OperatorProposals, AnEditThatChangedNothingWasOvertaken) {
  const std::uint64_t proposed = write(kLate, kEarly);
  const EdgeId id = closure_of_record(*mapper_->view(), kEarly, kLate, proposed)->id;
  const auto take_out = [&] {
    const std::uint64_t sequence = mapper_->submit_and_wait(edit_record(id, EdgeAction::kRemove)).or_throw();
    EXPECT_TRUE(mapper_->wait_applied(sequence, soon()).ok());
    return changes_of_edit(*mapper_, sequence);
  };
  const auto first = take_out().or_throw();
  ASSERT_TRUE(first.has_value());
  ASSERT_EQ(first->size(), 1u);
  EXPECT_EQ(first->front().id, id);
  EXPECT_EQ(take_out().status().to_string(), overtaken().to_string()) << "it was removed already";
  EXPECT_FALSE(changes_of_edit(*mapper_, durable() + 1).or_throw().has_value()) << "of no record that is remembered";
}

TEST_F(OperatorProposals, FramesOfDifferentPlacesAreRefused) {
  EXPECT_EQ(find({1, 4}, {1, 26}).reason(), Reason::TOO_FEW_INLIERS);
}

}  // namespace
}  // namespace relmap::map
