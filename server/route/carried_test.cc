#include "server/route/carried.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/route/dijkstra.h"
#include "server/route/testing/drawn_map.h"
#include "server/route/transform.h"

namespace relmap::route {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Up in a lift from B to D, back along the upper floor, and down again: E is seen from D, F from A.
class Carried : public testing::Test {
 protected:
  Carried()
      : map_(R"(
    E-----D
          |
          C
          |
    A-----B
  )") {
    map_.drive("ABCDE");
    for (const char frame : {'C', 'D'}) map_.editable(map_.id(frame)).edges.front().carried_by = {kFirst, kSecond};
  }

  std::vector<CarriedStretch> on_route(char from, char to) {
    const FrameId start[] = {map_.id(from)}, goal[] = {map_.id(to)};
    return find_route(map_, start, goal).or_throw().carried.list();
  }

  static constexpr EdgeId kFirst{{1, 40}, 1}, kSecond{{1, 41}, 1};
  DrawnMap map_;
};

TEST_F(Carried, ARouteListsCarriedStretchesInEitherDirection) {
  const CarriedStretch lift{map_.id('B'), map_.id('D'), {kFirst, kSecond}};
  EXPECT_THAT(on_route('A', 'E'), ElementsAre(lift));
  EXPECT_THAT(on_route('E', 'A'), ElementsAre(lift));
  EXPECT_THAT(on_route('C', 'E'), ElementsAre(CarriedStretch{map_.id('C'), map_.id('D'), {kFirst, kSecond}}));
  EXPECT_THAT(on_route('A', 'B'), IsEmpty());
}

TEST_F(Carried, EachStepTellsWhetherTheRobotWasCarried) {
  const FrameId start[] = {map_.id('A')}, goal[] = {map_.id('E')};
  const Route route = find_route(map_, start, goal).or_throw();
  std::string carried;
  for (RouteWalk walk(map_, route); const auto step = walk.next();)
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

}  // namespace
}  // namespace relmap::route
