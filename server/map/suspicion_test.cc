#include "server/map/suspicion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "server/map/testing/ordinary_closure.h"

namespace relmap::map {
namespace {

using storage::ClosureDigest;
using testing::HasSubstr;
using testing::IsEmpty;

ClosureDigest ordinary_but(void (*change)(ClosureDigest&)) {
  ClosureDigest closure = ordinary_closure();
  change(closure);
  return closure;
}

// The weight of a kind of doubt, and its message; 0 without one.
double weight_of(const ClosureDigest& closure, DoubtKind kind) {
  for (const Doubt& doubt : suspicion_of(closure).doubts)
    if (doubt.kind == kind) return doubt.weight;
  return 0;
}
std::string words_of(const ClosureDigest& closure, DoubtKind kind) {
  for (const Doubt& doubt : suspicion_of(closure).doubts)
    if (doubt.kind == kind) return doubt.message;
  return {};
}

TEST(Suspicion, OfAnOrdinaryClosureIsSmall) { EXPECT_LT(suspicion_value(ordinary_closure()), 0.05); }

TEST(Suspicion, CombinesItsDoubtsAsIndependentOnesAndListsTheHeaviestFirst) {
  const Suspicion found = suspicion_of(ordinary_but([](ClosureDigest& c) {
    c.inliers = 25;
    c.agreeing = 1;
    c.unseen = 3;
    c.tension = 8;
  }));
  double right = 1, before = 1;
  for (const Doubt& doubt : found.doubts) {
    EXPECT_GT(doubt.weight, 0);
    EXPECT_LE(doubt.weight, before);
    EXPECT_NE(doubt.message, "");
    before = doubt.weight;
    right *= 1 - doubt.weight;
  }
  EXPECT_GE(found.doubts.size(), 4u);
  EXPECT_NEAR(found.value, 1 - right, 1e-12);
}

TEST(Suspicion, EachFactThatSpeaksAgainstAClosureRaisesIt) {
  const struct {
    DoubtKind kind;
    void (*worse)(ClosureDigest&);
    const char* says;
  } facts[] = {
      {DoubtKind::kFewInliers, [](ClosureDigest& c) { c.inliers = 24; }, "24 points"},
      {DoubtKind::kPoorSpread, [](ClosureDigest& c) { c.spread = 0.08F; }, "8 %"},
      {DoubtKind::kImprobable, [](ClosureDigest& c) { c.probability = 0.2F; }, "0.2"},
      {DoubtKind::kRunnerUp, [](ClosureDigest& c) { c.uniqueness.runner_up_inliers = 70; }, "70 points fit at 2:3"},
      {DoubtKind::kChanged, [](ClosureDigest& c) { c.uniqueness.differs = 0.6F; }, "60 %"},
      {DoubtKind::kContradiction, [](ClosureDigest& c) { c.tests.opposing = 7; }, "7 closures contradict"},
      {DoubtKind::kContradiction, [](ClosureDigest& c) { c.was_contradicted = true; }, "history"},
      {DoubtKind::kContradiction, [](ClosureDigest& c) { c.looks_alike = true; }, "look alike"},
      {DoubtKind::kContradiction, [](ClosureDigest& c) { c.tests.motion = storage::MotionSays::kContradicts; },
       "motion contradicts"},
      {DoubtKind::kLonely, [](ClosureDigest& c) { c.agreeing = 0; }, "no other closure"},
      {DoubtKind::kTension, [](ClosureDigest& c) { c.tension = 12; }, "12 standard deviations"},
      {DoubtKind::kUnseen, [](ClosureDigest& c) { c.unseen = 6; }, "6 frames"},
  };
  for (const auto& fact : facts) {
    const ClosureDigest worse = ordinary_but(fact.worse);
    EXPECT_GT(weight_of(worse, fact.kind), weight_of(ordinary_closure(), fact.kind)) << fact.says;
    EXPECT_GT(suspicion_value(worse), suspicion_value(ordinary_closure())) << fact.says;
    EXPECT_THAT(words_of(worse, fact.kind), HasSubstr(fact.says));
  }
}

TEST(Suspicion, WeighsWhatPicturesShowLessIfOthersConfirmIt) {
  const auto poor = [](std::uint16_t agreeing) {
    ClosureDigest closure = ordinary_closure();
    closure.inliers = 25;
    closure.tests = {};
    closure.agreeing = agreeing;
    return closure;
  };
  EXPECT_GT(weight_of(poor(0), DoubtKind::kFewInliers), 2 * weight_of(poor(6), DoubtKind::kFewInliers));
  EXPECT_GT(suspicion_value(poor(0)), suspicion_value(poor(1)));
  EXPECT_GT(suspicion_value(poor(1)), suspicion_value(poor(6)));
}

TEST(Suspicion, FindsWhatLooksGoodButFitsNothing) {
  // A look-alike: its own figures are those of a true one.
  const ClosureDigest planted = ordinary_but([](ClosureDigest& c) {
    c.agreeing = 0;
    c.tests = {3, storage::MotionSays::kContradicts, 0.5F};
    c.reason = Reason::ACCEPTED_BY_OPERATOR;
  });
  EXPECT_GT(suspicion_value(planted), 0.8);
  EXPECT_THAT(suspicion_of(planted).remark, HasSubstr("operator"));
  ClosureDigest undecided = planted;
  undecided.reason = Reason::CONSISTENT;
  EXPECT_EQ(suspicion_value(undecided), suspicion_value(planted)) << "who put it into force is no fact about it";
  EXPECT_EQ(suspicion_of(undecided).remark, "");
}

TEST(Suspicion, OfManyAgainstOneIsTheOnes) {
  const auto opposed = [](std::uint16_t opposing, std::uint16_t agreeing) {
    ClosureDigest closure = ordinary_closure();
    closure.agreeing = agreeing;
    closure.tests.opposing = opposing;
    return suspicion_value(closure);
  };
  EXPECT_GT(opposed(6, 0), opposed(1, 6) + 0.4);
}

TEST(Suspicion, SaysWhatIsNotKnown) {
  ClosureDigest imported = ordinary_closure();
  imported.verification = storage::Verification::kImported;
  imported.inliers = 0;
  imported.probability = imported.spread = 0;
  imported.uniqueness = {};
  EXPECT_LT(suspicion_value(imported), 0.05) << "what is not known weighs nothing";
  EXPECT_THAT(suspicion_of(imported).remark, HasSubstr("imported"));
  imported.agreeing = 0;
  imported.tests = {};
  EXPECT_GT(suspicion_value(imported), 0.5) << "that it is lonely is known";

  ClosureDigest bridge;
  bridge.verification = storage::Verification::kCompounded;
  EXPECT_EQ(suspicion_value(bridge), 0);
  EXPECT_THAT(suspicion_of(bridge).remark, HasSubstr("deleted session"));

  ClosureDigest proposed = ordinary_closure();
  proposed.uniqueness = {};
  EXPECT_THAT(suspicion_of(proposed).remark, HasSubstr("not measured"));
}

TEST(Suspicion, IsOfLoopClosuresOnly) {
  ClosureDigest step;
  step.kind = storage::EdgeKind::kOdometry;
  EXPECT_EQ(suspicion_value(step), 0);
  EXPECT_THAT(suspicion_of(step).doubts, IsEmpty());
}

TEST(Suspicion, StaysBetweenNoneAndCertain) {
  ClosureDigest worst;
  worst.verification = storage::Verification::kStereo;
  worst.unseen = 64;
  worst.tension = 1e6F;
  worst.was_contradicted = true;
  worst.tests = {60000, storage::MotionSays::kContradicts, 0.1F};
  worst.uniqueness = {.known = true, .runner_up = {2, 3}, .runner_up_inliers = 60000, .runner_up_probability = 1};
  worst.uniqueness.differs = 1;
  EXPECT_LE(suspicion_value(worst), 1);
  EXPECT_GT(suspicion_value(worst), 0.99);
}

}  // namespace
}  // namespace relmap::map
