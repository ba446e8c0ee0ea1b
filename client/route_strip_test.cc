#include "client/route_strip.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client/testing/svg.h"

namespace relmap::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<RouteStep> steps_at(const std::vector<double>& metres) {
  std::vector<RouteStep> steps;
  for (const double at : metres) {
    RouteStep& step = steps.emplace_back();
    step.frame = {1, static_cast<std::uint32_t>(steps.size() - 1)};
    step.distance_m = at;
  }
  return steps;
}

RouteStrip strip_of(std::size_t stops) {
  RouteStrip strip;
  strip.title = "From 1:0 to kitchen";
  RouteStrip::Way way{"120.0 m, 2 min 00 s", {}};
  for (std::size_t i = 0; i < stops; ++i) {
    const double at = 120.0 * static_cast<double>(i) / static_cast<double>(stops - 1);
    strip.stops.push_back(
        {{1, static_cast<std::uint32_t>(i)}, at, at, "", i == 2 ? "a rather long name of a hall" : ""});
    way.points.push_back({at, 0.01 * std::sqrt(at)});
  }
  strip.ways = {way, way};
  strip.ways[1].name = "134.2 m, alternative 1";
  strip.marks = {{40, "kitchen"}, {42, "hall"}};
  strip.stretches = {{RouteStrip::StretchKind::kCarried, 20, 35},
                     {RouteStrip::StretchKind::kUnmeasured, 60, 61},
                     {RouteStrip::StretchKind::kUnmeasured, 110, 120}};
  return strip;
}

TEST(EvenlyAlong, BeginsAndEndsWithTheRouteAndGoesByDistance) {
  EXPECT_THAT(evenly_along(steps_at({0, 1, 2, 3, 4, 10, 11, 20}), 3), ElementsAre(0u, 5u, 7u));
  EXPECT_THAT(evenly_along(steps_at({0, 1, 2, 3}), 20), ElementsAre(0u, 1u, 2u, 3u)) << "no step twice";
  EXPECT_THAT(evenly_along(steps_at({0, 0, 0, 0, 0}), 3), ElementsAre(0u, 2u, 4u)) << "a robot that only turned";
  EXPECT_THAT(evenly_along(steps_at({0}), 5), ElementsAre(0u));
  EXPECT_TRUE(evenly_along({}, 5).empty());
}

TEST(StretchesOf, JoinsNeighbouringSteps) {
  auto steps = steps_at({0, 1, 2, 3, 4, 5});
  steps[1].carried = steps[2].carried = steps[4].carried = true;
  steps[5].carried = true;  // the last step leads nowhere
  steps[0].unmeasured = true;
  const auto stretches = stretches_of(steps);
  ASSERT_EQ(stretches.size(), 3u);
  EXPECT_EQ(stretches[0].from_m, 1);
  EXPECT_EQ(stretches[0].to_m, 3);
  EXPECT_EQ(stretches[1].from_m, 4);
  EXPECT_EQ(stretches[1].to_m, 5);
  EXPECT_EQ(stretches[2].kind, RouteStrip::StretchKind::kUnmeasured);
}

TEST(RouteStrip, NoTwoTicksAndNoTwoStopsOfAShortRouteReadAlike) {
  for (const double length : {0.013, 0.21, 0.4, 0.9, 1.77, 7.0, 41.0, 1'300.0, 4'000.0, 90'000.0}) {
    RouteStrip strip;
    RouteStrip::Way way{"a way", {}};
    for (int i = 0; i < 5; ++i) {
      strip.stops.push_back({{1, static_cast<std::uint32_t>(i)}, length * i / 4, 1.0 * i, "", ""});
      way.points.push_back({length * i / 4, 0.0004 * length * i});
    }
    strip.ways = {way};
    std::vector<std::string> ticks, stops;
    const std::string svg = draw_route_strip(strip, PictureFormat::kSvg).or_throw();
    for (const SvgText& text : texts_of(svg)) {
      const bool length_text = text.text.ends_with("m") && text.text.find(' ') != std::string::npos;
      if (length_text && text.size == 12) ticks.push_back(text.text);
      if (text.text.find(", 0:0") != std::string::npos) stops.push_back(text.text.substr(0, text.text.find(',')));
    }
    EXPECT_GE(ticks.size(), 5u) << svg;
    EXPECT_EQ(stops.size(), 5u);
    for (std::vector<std::string>* const all : {&ticks, &stops}) {
      std::sort(all->begin(), all->end());
      EXPECT_EQ(std::adjacent_find(all->begin(), all->end()), all->end()) << length << ::testing::PrintToString(*all);
    }
  }
}

TEST(RouteStrip, ShowsEveryStopAndExplainsItsStretches) {
  for (const std::size_t stops : {5u, 12u, 30u}) {
    const std::string svg = draw_route_strip(strip_of(stops), PictureFormat::kSvg).or_throw();
    const std::string said = said_in(svg);
    EXPECT_EQ(count_in(said, "no picture"), static_cast<int>(stops)) << "none was given";
    for (const char* text : {"From 1:0 to kitchen", "a robot was carried here", "nothing measured this: a guess",
                             "standard deviation of the position", "alternative 1", "kitchen", "hall", "120 m, 2:00"})
      EXPECT_THAT(said, HasSubstr(text)) << stops;
    EXPECT_THAT(said, ::testing::Not(HasSubstr("nan")));
    EXPECT_THAT(said, ::testing::Not(HasSubstr("passable by assumption"))) << "there is no such loop";
    expect_nothing_cut_off(svg);
  }
}

TEST(RouteStrip, EndsAreDrawnWhereTheyAre) {
  RouteStrip strip = strip_of(4);
  strip.ways = {{"a way that is lost", {{0, 0}, {60, 5}, {120, std::nan("")}}}};
  EXPECT_TRUE(draw_route_strip(strip, PictureFormat::kPng).ok());
  strip.stops.resize(1);
  strip.ways.clear();
  EXPECT_TRUE(draw_route_strip(strip, PictureFormat::kSvg).ok());
  EXPECT_EQ(draw_route_strip({}, PictureFormat::kSvg).reason(), Reason::EMPTY_MAP);
}

}  // namespace
}  // namespace relmap::client
