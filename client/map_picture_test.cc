#include "client/map_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "client/drawing.h"
#include "client/label_placement.h"
#include "client/map_plan.h"

namespace relmap {
namespace {

using EdgeKind = MapPicture::EdgeKind;

class MapPictureFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() / (std::string("relmap_map_picture_") + info->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  static std::string contents(const std::string& file) {
    std::ifstream in(file, std::ios::binary);
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
  }
  std::filesystem::path folder_;
};

MapPicture circle(int frames = 60) {
  MapPicture picture;
  for (int k = 0; k < frames; ++k) {
    const double angle = 2 * M_PI * k / frames;
    SE3 T;
    T.R = so3_exp(Vector3(0, angle, 0));
    T.t = Vector3(-10 * std::cos(angle), 0, 10 * std::sin(angle));
    picture.frames.push_back({{1, static_cast<std::uint32_t>(k)}, T});
    if (k > 0) picture.edges.push_back({picture.frames[k - 1].id, picture.frames[k].id, EdgeKind::kOdometry});
  }
  return picture;
}

int count(const std::string& text, const std::string& part) {
  int n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST_F(MapPictureFile, SvgHoldsWhatThePictureSays) {
  MapPicture picture = circle();
  picture.title = "Street <A> & B";
  picture.session_names[1] = "robot-7";
  picture.labels = {{{1, 30}, "loading dock"}, {{9, 9}, "elsewhere"}};
  picture.edges.push_back({{1, 0}, {1, 59}, EdgeKind::kLoopAccepted});
  picture.edges.push_back({{1, 5}, {1, 40}, EdgeKind::kLoopCandidate});
  picture.edges.push_back({{1, 5}, {9, 9}, EdgeKind::kLoopAccepted});  // leads out of the picture
  picture.route = MapPicture::Route{{{1, 3}, {1, 4}, {1, 5}}, "route to the loading dock, 12 m"};
  ASSERT_TRUE(write_map_picture(picture, path("map.svg")).ok());
  const std::string svg = contents(path("map.svg"));
  EXPECT_THAT(svg, ::testing::StartsWith("<svg "));
  EXPECT_THAT(svg, ::testing::EndsWith("</svg>\n"));
  for (const char* text : {"Street &lt;A&gt; &amp; B", "robot-7", "loading dock", "1 loop closure<",
                           "1 candidate closure<", "60 keyframes", "start", "end"})
    EXPECT_THAT(svg, ::testing::HasSubstr(text));
  EXPECT_THAT(svg, ::testing::Not(::testing::HasSubstr("elsewhere")));
  EXPECT_THAT(svg, ::testing::Not(::testing::HasSubstr("nan")));
}

TEST_F(MapPictureFile, MotionIsDrawnOnlyWhereAnEdgeSaysSo) {
  MapPicture whole = circle(3), broken = circle(3);
  broken.edges.pop_back();
  ASSERT_TRUE(write_map_picture(whole, path("whole.svg")).ok());
  ASSERT_TRUE(write_map_picture(broken, path("broken.svg")).ok());
  EXPECT_GT(count(contents(path("whole.svg")), "<polyline"), count(contents(path("broken.svg")), "<polyline"));
}

TEST_F(MapPictureFile, PngIsAPictureOfThePage) {
  MapPicture picture = circle();
  picture.png_scale = 1;
  ASSERT_TRUE(write_map_picture(picture, path("map.png")).ok());
  const std::string png = contents(path("map.png"));
  ASSERT_GT(png.size(), 5000U);
  EXPECT_EQ(png.substr(1, 3), "PNG");
  const auto number = [&](std::size_t at) {
    return static_cast<unsigned char>(png[at + 2]) * 256 + static_cast<unsigned char>(png[at + 3]);
  };
  EXPECT_EQ(number(16), 1200);
  EXPECT_GT(number(20), 500);
  EXPECT_LT(number(20), 1000);
}

TEST_F(MapPictureFile, ASingleFrameAndManySessionsAreFine) {
  ASSERT_TRUE(write_map_picture(circle(1), path("one.svg")).ok());
  MapPicture many;
  for (std::uint32_t s = 1; s <= 30; ++s) many.frames.push_back({{s, 0}, SE3{Matrix3::Identity(), Vector3(s, 0, 0)}});
  ASSERT_TRUE(write_map_picture(many, path("many.svg")).ok());
  EXPECT_THAT(contents(path("many.svg")), ::testing::HasSubstr("22 more sessions"));
}

TEST_F(MapPictureFile, WhatCannotBeDrawnIsRefusedByName) {
  EXPECT_EQ(write_map_picture(circle(), path("map.jpg")).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(write_map_picture({}, path("map.svg")).reason(), Reason::EMPTY_MAP);
  EXPECT_EQ(write_map_picture(circle(), path("no/such/folder/map.svg")).reason(), Reason::IO_ERROR);
  EXPECT_EQ(write_map_picture(circle(), path("no/such/folder/map.png")).reason(), Reason::IO_ERROR);
  MapPicture broken = circle();
  broken.frames[3].T_picture_frame.t.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(write_map_picture(broken, path("map.svg")).reason(), Reason::INVALID_ARGUMENT);
}

TEST(MapPlan, LooksFromAboveWithZUp) {
  const MapPlan plan({{0, 0, 0}, {10, -3, 0}, {10, 5, 20}}, 300, 400, false);
  EXPECT_DOUBLE_EQ(plan.points_per_metre(), 20);
  EXPECT_NEAR((plan.at({0, 7, 20}) - Vector2(50, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((plan.at({10, 0, 0}) - Vector2(250, 400)).norm(), 0, 1e-9);
  EXPECT_NEAR((plan.heading(SE3{}) - Vector2(0, -1)).norm(), 0, 1e-9);
}

TEST(MapPlan, TurnsTheLongSideAcross) {
  std::vector<Vector3> line;
  for (int k = 0; k <= 20; ++k) line.emplace_back(k, 0, 2.0 * k);
  const MapPlan plan(line, 900, 600, true);
  EXPECT_NEAR(plan.points_per_metre(), 900 / std::hypot(20, 40), 0.1);
  for (const Vector3& p : line) {
    EXPECT_GE(plan.at(p).x(), -1e-6);
    EXPECT_LE(plan.at(p).x(), 900 + 1e-6);
    EXPECT_LE(plan.at(p).y(), plan.height() + 1e-6);
  }
  // Turned, not mirrored: a right turn stays one.
  const Vector2 a = plan.heading(SE3{}), b = plan.heading(SE3{so3_exp(Vector3(0, 0.5, 0)), Vector3::Zero()});
  EXPECT_GT(a.x() * b.y() - a.y() * b.x(), 0);
}

TEST(LabelPlacement, TextsHideNeitherEachOtherNorTheTrajectory) {
  const Box area{{0, 0}, {400, 300}};
  LabelPlacement placement(area);
  std::vector<Vector2> way;
  for (int x = 0; x <= 400; x += 4) way.emplace_back(x, 150);
  for (const Vector2& p : way) placement.avoid(p);
  std::vector<Box> placed;
  for (int k = 0; k < 6; ++k) placed.push_back(placement.place({180.0 + 8 * k, 150}, {70, 16}));
  for (std::size_t i = 0; i < placed.size(); ++i) {
    EXPECT_TRUE(area.contains(placed[i].low) && area.contains(placed[i].high));
    for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(placed[i].overlaps(placed[j])) << i << " " << j;
    for (const Vector2& p : way) EXPECT_FALSE(placed[i].contains(p));
  }
}

TEST(SideBySide, ComponentsDoNotOverlapAndTheLargestComesFirst) {
  Relaxation relaxation;
  relaxation.components = 2;
  for (std::uint32_t k = 0; k < 5; ++k)
    relaxation.poses.push_back({{1, k}, SE3{Matrix3::Identity(), Vector3(k, 0, -3)}, 0});
  for (std::uint32_t k = 0; k < 9; ++k)
    relaxation.poses.push_back({{2, k}, SE3{Matrix3::Identity(), Vector3(-2.0 * k, 0, 5)}, 1});
  const auto frames = side_by_side(relaxation);
  ASSERT_EQ(frames.size(), 14U);
  double high = -1e9, low = 1e9;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const double x = frames[k].T_picture_frame.t.x();
    if (frames[k].id.session == 2) high = std::max(high, x);
    if (frames[k].id.session == 1) low = std::min(low, x);
    EXPECT_EQ(frames[k].id, relaxation.poses[k].frame);
  }
  EXPECT_GT(low, high + 1);
}

}  // namespace
}  // namespace relmap
