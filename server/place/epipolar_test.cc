#include "server/place/epipolar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "proto/geometry/camera.h"

namespace relmap::place {
namespace {

constexpr StereoCamera kVgaEye{500, 320, 240, 0, 640, 480};

struct TwoViews {
  std::vector<AppearanceFeature> a, b;
};

// `points` seen from two places; the first `wrong` of them are at a wrong position in the second view.
TwoViews views_of(const std::vector<Vector3>& points, std::size_t wrong) {
  std::mt19937_64 random(7);
  const SE3 T_ba = SE3::exp((Vector6() << -0.5, 0.1, 0.2, 0.02, 0.06, -0.03).finished());
  TwoViews views;
  for (std::size_t i = 0; i < points.size(); ++i) {
    AppearanceFeature feature;
    for (auto& byte : feature.descriptor) byte = static_cast<std::uint8_t>(random() % 90);
    const auto put = [&](const StereoPixel& z) {
      feature.u = static_cast<float>(z.x());
      feature.v = static_cast<float>(z.y());
      return feature;
    };
    views.a.push_back(put(kVgaEye.project(points[i])));
    StereoPixel z = kVgaEye.project(T_ba * points[i]);
    if (i < wrong) z = {static_cast<double>(random() % 640), static_cast<double>(random() % 480), kNoRight};
    views.b.push_back(put(z));
  }
  return views;
}

// Points within the field of view; `depth` gives the depth of each.
template <typename Depth>
std::vector<Vector3> points(std::size_t count, Depth depth) {
  std::mt19937_64 random(3);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<Vector3> result;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = uniform(-0.5, 0.5), y = uniform(-0.4, 0.4), z = depth(x, y, uniform(0, 1));
    result.push_back({x * z, y * z, z});
  }
  return result;
}

TEST(MatchViews, ViewsOfThingsInDepthAgreeOnAFundamentalMatrix) {
  const auto views = views_of(points(120, [](double, double, double u) { return 3 + 12 * u; }), 30);
  const auto match = match_views(views.b, views.a);
  ASSERT_TRUE(match.ok()) << match.status().to_string();
  EXPECT_FALSE(match->homography);
  EXPECT_GE(match->inliers.size(), 85u);
  EXPECT_TRUE(std::is_sorted(match->inliers.begin(), match->inliers.end()));
}

TEST(MatchViews, ViewsOfOnePlaneAgreeOnAHomography) {
  const auto views = views_of(points(120, [](double x, double, double) { return 5 / (1 - 0.6 * x); }), 30);
  const auto match = match_views(views.b, views.a);
  ASSERT_TRUE(match.ok()) << match.status().to_string();
  EXPECT_TRUE(match->homography);
  EXPECT_GE(match->inliers.size(), 85u);
  EXPECT_LE(match->inliers.size(), 95u);
}

TEST(MatchViews, ViewsWithoutACommonGeometryAreRefused) {
  const auto scene = points(120, [](double, double, double u) { return 3 + 12 * u; });
  const auto wrong = views_of(scene, 120);
  EXPECT_EQ(match_views(wrong.b, wrong.a).reason(), Reason::TOO_FEW_INLIERS);
  const auto few = views_of({scene.begin(), scene.begin() + 29}, 0);
  EXPECT_EQ(match_views(few.b, few.a).reason(), Reason::TOO_FEW_INLIERS);
  EXPECT_EQ(match_views({}, few.a).reason(), Reason::TOO_FEW_INLIERS);
}

}  // namespace
}  // namespace relmap::place
