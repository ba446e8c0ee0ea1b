#include "server/place/trials.h"

#include <gtest/gtest.h>

#include "server/place/testing/synthetic_street.h"

namespace relmap::place {
namespace {

constexpr SessionNumber kStreet = 1, kPhotographs = 5;

// A street that one session drove through, and a session of photographs without metres, which show nothing of it.
class TrialsTest : public ::testing::Test {
 protected:
  TrialsTest() : street_(1, 12, 0) {
    street_.graph.add_session(kPhotographs, {400, 255.5, 191.5, 0, 512, 384});
    street_.graph.add_frame({kPhotographs, 0});
    std::vector<std::size_t> points;
    features_ = street_.picture(street_.pose(6), true, points);
  }
  Trials trials() { return {street_.graph, {features_, kStreetCamera}, 7, proceed_}; }

  SyntheticStreet street_;
  std::vector<AppearanceFeature> features_;
  int asked_ = 0, allowed_ = 100;
  const Proceed proceed_ = [this] { return ++asked_ > allowed_ ? Status(Reason::DEADLINE, "late") : Status(); };
  const std::vector<PlaceCandidate> candidates_{
      {{kPhotographs, 0}, 0.5}, {{kStreet, 6}, 0.3}, {{kStreet, 99}, 0.1}, {{kStreet, 2}, 0.01}};
};

TEST_F(TrialsTest, TriesEveryCandidateInTurnAndKnowsWhereMostFits) {
  Trials trials = this->trials();
  ASSERT_TRUE(trials.run(candidates_, {}).ok());
  ASSERT_EQ(trials.size(), 4u);
  EXPECT_EQ(trials.best(), 1u);
  EXPECT_EQ(trials.candidate(1).probability, 0.3);
  EXPECT_FALSE(trials.all()[0].verified.ok());
  EXPECT_EQ(trials.all()[2].verified.reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(asked_, 4);
}

TEST_F(TrialsTest, EndsAtTheLimitsOfARun) {
  Trials probable = trials();
  ASSERT_TRUE(probable.run(candidates_, {.min_probability = 0.2}).ok());
  EXPECT_EQ(probable.size(), 2u);

  Trials few = trials();
  ASSERT_TRUE(few.run(candidates_, {.max_trials = 1}).ok());
  EXPECT_EQ(few.size(), 1u);
  ASSERT_TRUE(few.run(candidates_, {.max_trials = 1, .skip_mono = true}).ok()) << "the limit is of each run";
  ASSERT_EQ(few.size(), 2u);
  EXPECT_EQ(few.candidate(1).frame, (FrameId{kStreet, 6}));

  Trials sure = trials();
  ASSERT_TRUE(sure.run(candidates_, {.sure_inliers = 30}).ok());
  EXPECT_EQ(sure.size(), 2u) << "the street is beyond doubt";
}

TEST_F(TrialsTest, EndsWithWhatProceedSaysAndKeepsWhatItHas) {
  allowed_ = 2;
  Trials trials = this->trials();
  EXPECT_EQ(trials.run(candidates_, {}).reason(), Reason::DEADLINE);
  EXPECT_EQ(trials.size(), 2u);
  EXPECT_TRUE(trials.best().has_value());
}

TEST_F(TrialsTest, KeepsTheConfirmedOnesWithTheirCandidates) {
  Trials trials = this->trials();
  ASSERT_TRUE(trials.run(candidates_, {}).ok());
  trials.keep_confirmed();
  ASSERT_GE(trials.size(), 1u);
  EXPECT_EQ(trials.candidate(0).frame, (FrameId{kStreet, 6}));
  for (const PlaceTrial& trial : trials.all()) EXPECT_TRUE(trial.verified.ok());
  EXPECT_EQ(trials.tried(), 4u);
  const auto standing = trials.weigh(trials.size());
  ASSERT_TRUE(standing.has_value());
  EXPECT_EQ(standing->best, 0u);
}

TEST_F(TrialsTest, RefusesAPlaceWithoutMetresWhereTheyAreNeeded) {
  // Photographs of the same street: every feature agrees with itself.
  street_.graph.edit_cold({kPhotographs, 0}).appearance = features_;
  const std::vector<PlaceCandidate> candidate{{{kPhotographs, 0}, 0.5}};
  Trials either = trials();
  ASSERT_TRUE(either.run(candidate, {}).ok());
  ASSERT_TRUE(either.best().has_value());
  Trials metric = trials();
  ASSERT_TRUE(metric.run(candidate, {.needs_metres = true}).ok());
  EXPECT_FALSE(metric.best().has_value());
  EXPECT_EQ(metric.all()[0].verified.reason(), Reason::NOT_STEREO);
}

}  // namespace
}  // namespace relmap::place
