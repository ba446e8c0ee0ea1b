#include "server/place/reobserve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "frontend/vision/encoded_picture.h"
#include "frontend/vision/textures_for_test.h"
#include "server/place/testing/hand_made_graph.h"

namespace relmap::place {
namespace {

// Three frames of session 1 look at a textured wall and have landmarks on it; session 2 sees it in other light.
class Reobserve : public testing::Test {
 protected:
  static constexpr StereoCamera kCamera{400, 255.5, 191.5, 0.12, 512, 384};
  static constexpr double kDepth = 4;  // of the wall
  static constexpr FrameId kMatch{1, 1}, kFrame{2, 0};

  Reobserve() {
    for (const SessionNumber session : {1u, 2u}) graph_.add_session(session, kCamera);
    for (std::uint32_t i = 0; i < 3; ++i) {
      storage::FrameHot hot;
      storage::FrameWarm warm;
      for (double v = 40; v < 350; v += 44)
        for (double u = 40 + 11 * i; u < 480; u += 44) add_landmark({1, i}, u, v, hot, warm);
      add_frame({1, i}, T_wall_[i], std::move(hot), std::move(warm), 0, 1);
      if (i > 0) graph_.add_edge({1, i - 1}, {1, i}, 0, T_wall_[i - 1].inverse() * T_wall_[i]);
    }
    add_frame(kFrame, T_wall_frame_, {}, {}, 25, 0.8);
  }

  void add_landmark(FrameId base, double u, double v, storage::FrameHot& hot, storage::FrameWarm& warm) const {
    storage::Landmark landmark;
    landmark.abr = {(u - kCamera.cx) / kCamera.f, (v - kCamera.cy) / kCamera.f, 1 / kDepth};
    landmark.observers.assign(4, base);  // as many as reduce its covariance
    const LandmarkId id{base, static_cast<std::uint32_t>(hot.landmarks.size())};
    hot.landmarks.push_back(landmark);
    warm.observations.push_back(
        {id, {}, static_cast<float>(u), static_cast<float>(v), static_cast<float>(u - kDisparity), 0});
  }
  void add_frame(FrameId id, const SE3& T_wall_camera, storage::FrameHot hot, storage::FrameWarm warm, double brighter,
                 double contrast) {
    storage::FrameCold cold;
    cold.picture = vision::encode_picture(paint(T_wall_camera, brighter, contrast));
    graph_.add_frame(id, std::move(hot), std::move(warm), std::move(cold));
  }
  // The wall is at z = kDepth and the cameras face it.
  vision::Image paint(const SE3& T_wall_camera, double brighter, double contrast) {
    return vision::testing_textures::paint(kCamera.width, kCamera.height, [&](int u, int v) {
      const Vector3 ray((u - kCamera.cx) / kCamera.f, (v - kCamera.cy) / kCamera.f, 1);
      const Vector3 on_wall = T_wall_camera * (ray * ((kDepth - T_wall_camera.t.z()) / (T_wall_camera.R * ray).z()));
      return brighter + contrast * wall_.at(100 * on_wall.x(), 100 * on_wall.y()) + noise_(random_);
    });
  }
  // The true pixel of a landmark in the frame.
  StereoPixel seen(LandmarkId id) const {
    const Vector3 on_wall = T_wall_[id.base.index] * graph_.hot(id.base)->landmarks[id.slot].point();
    return kCamera.project(T_wall_frame_.inverse() * on_wall);
  }
  std::vector<storage::ProposedBinding> find(const SE3& T_match_frame, std::uint32_t first_maskable = 0) {
    const Standpoint standpoint{kMatch, T_match_frame, covariance()};
    return reobserve(graph_, *pictures_, kFrame, {&standpoint, 1}, first_maskable).bindings;
  }
  Changes changes_seen() {
    const Standpoint standpoint{kMatch, T_match_frame(), covariance()};
    return changes(reobserve(graph_, *pictures_, kFrame, {&standpoint, 1}, 0).sought, kCamera);
  }
  static Matrix6 covariance() {  // 1 cm, 3 mrad
    return (Vector6() << 1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-5).finished().asDiagonal();
  }
  SE3 T_match_frame() const { return T_wall_[1].inverse() * T_wall_frame_; }

  static constexpr double kDisparity = kCamera.f * kCamera.baseline / kDepth;
  const SE3 T_wall_[3] = {{}, {Matrix3::Identity(), {0.15, 0, 0}}, {Matrix3::Identity(), {0.3, 0, 0}}};
  const SE3 T_wall_frame_ =
      SE3{Matrix3::Identity(), {0.2, 0.05, 0.25}} * SE3::exp((Vector6() << 0, 0, 0, 0.01, 0.02, 0.05).finished());
  const vision::testing_textures::Waves wall_{7, 7, 40, 40};
  std::mt19937 random_{1};
  std::normal_distribution<double> noise_{0, 1.5};
  HandMadeGraph graph_;
  std::optional<PictureCache> pictures_{std::in_place};  // emplaced anew after a picture has changed
};

TEST_F(Reobserve, MeasuresLandmarksToAFractionOfAPixelInOtherLight) {
  const SE3 guess = T_match_frame() * SE3::exp((Vector6() << 0.01, -0.01, 0.01, 0.002, -0.003, 0.002).finished());
  const auto bindings = find(guess);
  EXPECT_GT(bindings.size(), 100u);
  std::map<LandmarkId, int> times;
  double squares = 0;
  for (const storage::ProposedBinding& binding : bindings) {
    EXPECT_TRUE(binding.aligned);
    EXPECT_EQ(binding.track, -1);
    EXPECT_EQ(++times[binding.landmark], 1);
    const StereoPixel z = seen(binding.landmark);
    const double off = std::hypot(binding.u_left - z.x(), binding.v - z.y());
    EXPECT_LT(off, 1) << binding.landmark.to_string();
    squares += off * off;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(bindings.size())), 0.2);
}

TEST_F(Reobserve, FindsNothingWithoutFullPicturesOfBothFrames) {
  const Bytes picture = graph_.edit_cold(kFrame).picture;
  graph_.edit_cold(kFrame).picture = vision::thumbnail_of(picture);
  EXPECT_TRUE(find(T_match_frame()).empty());
  graph_.edit_cold(kFrame).picture = Bytes(6000, 0xff);
  pictures_.emplace();
  EXPECT_TRUE(find(T_match_frame()).empty());
  graph_.edit_cold(kFrame).picture = picture;
  for (std::uint32_t i = 0; i < 3; ++i) graph_.edit_cold({1, i}).picture.clear();
  pictures_.emplace();
  EXPECT_TRUE(find(T_match_frame()).empty());
}

TEST_F(Reobserve, ANewObjectIsAChangeAndOtherLightIsNot) {
  EXPECT_GE(changes_seen().compared, 20);
  EXPECT_EQ(changes_seen().changed, 0) << "25 grey levels brighter, at four fifths of the contrast";
  vision::Image picture = paint(T_wall_frame_, 25, 0.8);
  const vision::testing_textures::Waves poster(11, 11, 40, 40);
  for (int v = 64; v < 320; ++v)
    for (int u = 64; u < 192; ++u)
      picture.row(v)[u] = static_cast<std::uint8_t>(std::clamp(poster.at(u, v), 0.0, 255.0));
  graph_.edit_cold(kFrame).picture = vision::encode_picture(picture);
  pictures_.emplace();
  const Changes hung = changes_seen();
  EXPECT_GE(hung.changed, 4);
  EXPECT_LE(hung.changed, 10) << "of 8 cells that it covers";
}

TEST_F(Reobserve, APictureMayBeOfHalfTheSize) {
  graph_.edit_cold(kFrame).picture = vision::encode_picture(vision::halve(paint(T_wall_frame_, 0, 1)));
  const auto bindings = find(T_match_frame());
  EXPECT_GT(bindings.size(), 50u);
  for (const storage::ProposedBinding& binding : bindings) {
    EXPECT_EQ(binding.level, 1);
    const StereoPixel z = seen(binding.landmark);
    EXPECT_LT(std::hypot(binding.u_left - z.x(), binding.v - z.y()), 1.5);
  }
}

TEST_F(Reobserve, AWrongPlaceShowsNothing) {
  const SE3 wrong = T_match_frame() * SE3::exp((Vector6() << 0.4, 0.3, 0, 0, 0, 0.1).finished());
  EXPECT_TRUE(find(wrong).empty());
}

TEST_F(Reobserve, LandmarksThatTheFrameSeesAlreadyAreLeftOut) {
  const LandmarkId known{kMatch, 20};
  ASSERT_TRUE(std::ranges::any_of(find(T_match_frame()), [&](const auto& b) { return b.landmark == known; }));
  const StereoPixel z = seen(known);
  graph_.edit_warm(kFrame).observations = {
      {known, {}, static_cast<float>(z.x()), static_cast<float>(z.y()), static_cast<float>(z.z()), 0}};
  const auto bindings = find(T_match_frame());
  EXPECT_GT(bindings.size(), 100u);
  for (const storage::ProposedBinding& binding : bindings) EXPECT_NE(binding.landmark, known);
}

TEST_F(Reobserve, ATrackBesideALandmarkIsNotNeededUnlessItIsOfAnotherDepth) {
  const StereoPixel z = seen({kMatch, 20});
  storage::FrameHot& hot = graph_.edit_hot(kFrame);
  storage::FrameWarm& warm = graph_.edit_warm(kFrame);
  const auto begin_track = [&](double du, double disparity) {
    const LandmarkId id{kFrame, static_cast<std::uint32_t>(hot.landmarks.size())};
    hot.landmarks.emplace_back();
    const auto u = static_cast<float>(z.x() + du);
    warm.observations.push_back({id, {}, u, static_cast<float>(z.y()), static_cast<float>(u - disparity), 0});
  };
  begin_track(6, z.x() - z.z());
  begin_track(6, 2.5 * (z.x() - z.z()));
  begin_track(6, kNoRight);
  std::vector<std::int32_t> not_needed;
  for (const storage::ProposedBinding& binding : find(T_match_frame()))
    if (!binding.landmark.valid()) not_needed.push_back(binding.track);
  EXPECT_EQ(not_needed, (std::vector<std::int32_t>{0, 2}));
}

// A place that was passed often enough needs no new landmarks.
TEST_F(Reobserve, NoTrackIsNeededWhereEnoughLandmarksAreFixed) {
  storage::FrameHot& hot = graph_.edit_hot(kFrame);
  hot.landmarks.resize(1);
  const StereoPixel z = seen({kMatch, 20});
  const auto u = static_cast<float>(z.x());
  graph_.edit_warm(kFrame).observations = {{{kFrame, 0}, {}, u, static_cast<float>(z.y()), u - 40, 0}};
  const auto not_needed = [&] {
    const auto bindings = find(T_match_frame());
    return std::ranges::count_if(bindings, [](const storage::ProposedBinding& b) { return !b.landmark.valid(); });
  };
  EXPECT_EQ(not_needed(), 0) << "it is much nearer than the wall";
  for (std::uint32_t i = 0; i < 3; ++i)
    for (storage::Landmark& landmark : graph_.edit_hot({1, i}).landmarks)
      landmark.observers = {{1, i}, {2, 100}, {3, 100}, {4, 100}, {5, 100}};
  EXPECT_EQ(not_needed(), 1);
}

// The disparity of a feature holds for a landmark at the same pixel.
TEST_F(Reobserve, TakesTheDisparityOfAFeatureAtTheSamePixel) {
  const LandmarkId landmark{kMatch, 20};
  const StereoPixel z = seen(landmark);
  AppearanceFeature feature;
  feature.u = static_cast<float>(z.x() + 1);
  feature.v = static_cast<float>(z.y());
  feature.disparity = static_cast<float>(z.x() - z.z() + 0.1);
  graph_.edit_cold(kFrame).appearance = {feature};
  int stereo = 0;
  for (const storage::ProposedBinding& binding : find(T_match_frame())) {
    stereo += !std::isnan(binding.u_right);
    if (binding.landmark == landmark) {
      EXPECT_NEAR(binding.u_right, z.z() - 0.1, 0.5);
    }
  }
  EXPECT_EQ(stereo, 1);
}

// A second pass may have hardly any tracks of its own, but its pictures show the landmarks that were aligned in them.
TEST_F(Reobserve, UsesPicturesInWhichLandmarksWereOnlyAligned) {
  for (const storage::ProposedBinding& binding : find(T_match_frame()))
    graph_.edit_warm(kFrame).observations.push_back(
        {binding.landmark, {{2, 0}, 1}, binding.u_left, binding.v, binding.u_right, binding.level, binding.aligned});
  graph_.add_edge(kMatch, kFrame, 1, T_match_frame());
  graph_.add_session(3, kCamera);
  const FrameId third{3, 0};
  add_frame(third, T_wall_frame_ * SE3{Matrix3::Identity(), {0.1, 0, 0}}, {}, {}, -10, 1.1);
  const Standpoint standpoint{kFrame, SE3{Matrix3::Identity(), {0.1, 0, 0}}, covariance()};
  const auto bindings = reobserve(graph_, *pictures_, third, {&standpoint, 1}, 0).bindings;
  EXPECT_GT(bindings.size(), 80u);
  for (const storage::ProposedBinding& binding : bindings) EXPECT_EQ(binding.landmark.base.session, 1u);
}

}  // namespace
}  // namespace relmap::place
