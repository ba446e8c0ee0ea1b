// Tests that readers can tell the colours of a map apart, including those who lack cones for red (protanopia), green
// (deuteranopia) or blue (tritanopia). Their sight is simulated by the matrices of Machado, Oliveira and Fernandes
// (IEEE TVCG 15(6), 2009) at full severity, in linear RGB. Distances are in CIELAB, where 2.3 is just noticeable.
#include "client/map_colours.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace relmap::client {
namespace {

Vector3 linear(Colour colour) {
  const auto channel = [](std::uint8_t value) {
    const double c = value / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  return {channel(colour.red), channel(colour.green), channel(colour.blue)};
}

Vector3 lab(const Vector3& rgb) {
  Matrix3 to_xyz;
  to_xyz << 0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920, 0.9503041;
  const Vector3 xyz = to_xyz * rgb;
  const auto f = [](double t) { return t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116; };
  const double x = f(xyz.x() / 0.95047), y = f(xyz.y()), z = f(xyz.z() / 1.08883);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

struct Eye {
  const char* name;
  Matrix3 sees;  // maps linear RGB to the linear RGB that this eye sees
};
std::vector<Eye> eyes() {
  const auto matrix = [](std::initializer_list<double> rows) {
    return Matrix3(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.begin()));
  };
  return {{"any", Matrix3::Identity()},
          {"protanopic",
           matrix({0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998})},
          {"deuteranopic",
           matrix({0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881})},
          {"tritanopic",
           matrix({1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.303900})}};
}

double distance(Colour a, Colour b, const Eye& eye) {
  const auto seen = [&](Colour colour) { return lab((eye.sees * linear(colour)).cwiseMax(0.0).cwiseMin(1.0)); };
  return (seen(a) - seen(b)).norm();
}

using Named = std::vector<std::pair<std::string, Colour>>;

Named marks() {
  return {{"loop closure", kLoopColour}, {"closure not in force", kNotInForceColour},
          {"route", kRouteColour},       {"query", kQueryColour},
          {"ink", kInkColour},           {"paper", {255, 255, 255}}};
}

void expect_apart(const Named& some, const Named& others, double min_distance) {
  for (const Eye& eye : eyes())
    for (const auto& [name, colour] : some)
      for (const auto& [other_name, other] : others)
        EXPECT_GT(distance(colour, other, eye), min_distance)
            << name << " and " << other_name << " to a " << eye.name << " eye";
}

// Thin lines need eight times the just noticeable distance.
constexpr double kApart = 16;

TEST(MapColours, AllCanBeToldApartByEveryEye) {
  Named all = marks();
  for (std::size_t place = 0; place < kSessionColours.size(); ++place)
    all.emplace_back("session " + std::to_string(place + 1), session_colour(place));
  while (!all.empty()) {
    const Named one{all.back()};
    all.pop_back();
    expect_apart(one, all, kApart);
  }
}

// Shades of a single session show time, from light to dark.
TEST(MapColours, ShadesOfASingleSessionLookLikeNothingElse) {
  Named shades;
  for (const double white : {0.5, 0.4, 0.3, 0.2, 0.1})
    shades.emplace_back("shade", mix(session_colour(0), {255, 255, 255}, white));
  expect_apart(shades, marks(), kApart);
}

TEST(MapColours, TheSimulationKnowsWhatIsConfused) {
  const Colour red{200, 60, 40}, green{120, 110, 30};
  EXPECT_GT(distance(red, green, eyes()[0]), 50);
  EXPECT_LT(distance(red, green, eyes()[2]), 15);
}

}  // namespace
}  // namespace relmap::client
