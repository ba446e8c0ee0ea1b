#include "server/route/stretches.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/route/dijkstra.h"
#include "server/route/neighbourhood.h"
#include "server/route/testing/drawn_map.h"
#include "server/route/transform.h"

namespace relmap::route {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// A robot that drove from A to B, by C to D, and on to E.
class Drive : public testing::Test {
 protected:
  Drive()
      : map_(R"(
    E-----D
          |
          C
          |
    A-----B
  )") {
    map_.drive("ABCDE");
  }

  Route route(char from, char to) const {
    const FrameId start[] = {map_.id(from)}, goal[] = {map_.id(to)};
    return find_route(map_, start, goal).or_throw();
  }

  DrawnMap map_;
};

// Up in a lift from B to D, back along the upper floor, and down again: E is seen from D, F from A.
class Carried : public Drive {
 protected:
  Carried() {
    for (const char frame : {'C', 'D'}) map_.editable(map_.id(frame)).edges.front().carried_by = {kFirst, kSecond};
  }

  std::vector<CarriedStretch> on_route(char from, char to) const { return route(from, to).carried.list(); }

  static constexpr EdgeId kFirst{{1, 40}, 1}, kSecond{{1, 41}, 1};
};

TEST_F(Carried, ARouteListsCarriedStretchesInEitherDirection) {
  const CarriedStretch lift{map_.id('B'), map_.id('D'), {kFirst, kSecond}};
  EXPECT_THAT(on_route('A', 'E'), ElementsAre(lift));
  EXPECT_THAT(on_route('E', 'A'), ElementsAre(lift));
  EXPECT_THAT(on_route('C', 'E'), ElementsAre(CarriedStretch{map_.id('C'), map_.id('D'), {kFirst, kSecond}}));
  EXPECT_THAT(on_route('A', 'B'), IsEmpty());
}

TEST_F(Carried, EachStepTellsWhetherTheRobotWasCarried) {
  const Route found = route('A', 'E');
  std::string carried;
  for (RouteWalk walk(map_, found); const auto step = walk.next();)
    if (step->carried) carried += map_.name(step->frame);
  EXPECT_EQ(carried, "BC") << "on the way on from there";
}

TEST_F(Carried, ATransformListsCarriedStretches) {
  const CarriedStretch lift{map_.id('B'), map_.id('D'), {kFirst, kSecond}};
  EXPECT_THAT(transform_between(map_, map_.id('A'), map_.id('E')).or_throw().carried.list(), ElementsAre(lift));
  EXPECT_THAT(transform_between(map_, map_.id('E'), map_.id('A')).or_throw().carried.list(), ElementsAre(lift));
  EXPECT_THAT(transform_between(map_, map_.id('D'), map_.id('E')).or_throw().carried.list(), IsEmpty());
}

TEST_F(Carried, TwoRidesAreTwoStretchesInTheOrderOfThePath) {
  map_.editable(map_.id('C')).edges.front().carried_by.clear();
  map_.editable(map_.id('B')).edges.front().carried_by = {kSecond};
  const CarriedStretch first{map_.id('A'), map_.id('B'), {kSecond}},
      last{map_.id('C'), map_.id('D'), {kFirst, kSecond}};
  EXPECT_THAT(on_route('A', 'E'), ElementsAre(first, last));
  EXPECT_THAT(on_route('E', 'A'), ElementsAre(last, first));
}

TEST(CarriedStretches, KeepsNoMoreThanAnAnswerHolds) {
  CarriedStretches stretches;
  for (std::uint32_t i = 0; i < 1000; ++i) stretches.add({1, 10 * i}, {1, 10 * i + 1}, {{{1, i}, 1}});
  EXPECT_EQ(stretches.list().size(), CarriedStretches::kMax);
  CarriedStretches ride;
  for (std::uint32_t i = 0; i < 100; ++i) ride.add({1, i}, {1, i + 1}, {{{1, 1000 + i}, 1}});
  ASSERT_EQ(ride.list().size(), 1u);
  EXPECT_EQ(ride.list().front().last, (FrameId{1, 100}));
  EXPECT_EQ(ride.list().front().closures.size(), CarriedStretch::kMaxNamed);
}

// A robot that saw nothing from B to D.
class Unmeasured : public Drive {
 protected:
  Unmeasured() { step_to('C').source = step_to('D').source = MotionSource::kUnsensed; }

  storage::Edge& step_to(char frame) { return map_.editable(map_.id(frame)).edges.front(); }
  UnmeasuredStretches on_route(char from, char to) const { return route(from, to).unmeasured; }
};

TEST_F(Unmeasured, ARouteListsUnmeasuredStretchesInEitherDirection) {
  const UnmeasuredStretch dark{map_.id('B'), map_.id('D'), 2, 4};
  EXPECT_THAT(on_route('A', 'E').list(), ElementsAre(dark));
  EXPECT_THAT(on_route('E', 'A').list(), ElementsAre(dark));
  EXPECT_EQ(on_route('E', 'A').steps(), 2u);
  EXPECT_EQ(on_route('E', 'A').distance_m(), 4);
  EXPECT_THAT(on_route('C', 'E').list(), ElementsAre(UnmeasuredStretch{map_.id('C'), map_.id('D'), 1, 2}));
  EXPECT_THAT(on_route('A', 'B').list(), IsEmpty());
  EXPECT_EQ(on_route('A', 'B').steps(), 0u);
}

TEST_F(Unmeasured, LandmarksSeenFromBothSidesMeasureAStep) {
  step_to('C').support = storage::kMinSupport;
  EXPECT_THAT(on_route('A', 'E').list(), ElementsAre(UnmeasuredStretch{map_.id('C'), map_.id('D'), 1, 2}));
}

TEST_F(Unmeasured, EachStepTellsWhetherItIsUnmeasured) {
  const Route found = route('A', 'E');
  std::string guessed;
  for (RouteWalk walk(map_, found); const auto step = walk.next();)
    if (step->unmeasured) guessed += map_.name(step->frame);
  EXPECT_EQ(guessed, "BC") << "on the way on from there";
}

TEST_F(Unmeasured, ATransformListsUnmeasuredStretches) {
  const UnmeasuredStretch dark{map_.id('B'), map_.id('D'), 2, 4};
  for (const auto& [a, b] : {std::pair{'A', 'E'}, {'E', 'A'}}) {
    const Transform found = transform_between(map_, map_.id(a), map_.id(b)).or_throw();
    EXPECT_THAT(found.unmeasured.list(), ElementsAre(dark));
    EXPECT_EQ(found.unmeasured.distance_m(), 4);
  }
  EXPECT_EQ(transform_between(map_, map_.id('D'), map_.id('E')).or_throw().unmeasured.steps(), 0u);
}

TEST_F(Unmeasured, ANeighbourhoodCountsUnmeasuredStepsOfEachFrame) {
  std::string steps;
  const Neighbourhood around = neighbourhood(map_, map_.id('A'), {}, {}).or_throw();
  for (const NeighbourhoodFrame& frame : around.frames)
    steps += map_.name(frame.frame) + std::to_string(frame.unmeasured_steps);
  EXPECT_EQ(steps, "A0B0C1D2E2");
}

TEST(UnmeasuredStretches, CountsStretchesForWhichTheListHasNoRoom) {
  UnmeasuredStretches stretches;
  storage::Edge gap;
  gap.kind = storage::EdgeKind::kPrior;
  gap.T_ab.t = {0, 0, 2};
  for (std::uint32_t i = 0; i < 1000; ++i) {
    gap.a = {1, 10 * i};
    gap.b = {1, 10 * i + 1};
    stretches.add(gap);
  }
  EXPECT_EQ(stretches.list().size(), UnmeasuredStretches::kMax);
  EXPECT_EQ(stretches.steps(), 1000u);
  EXPECT_EQ(stretches.distance_m(), 2000);
}

}  // namespace
}  // namespace relmap::route
