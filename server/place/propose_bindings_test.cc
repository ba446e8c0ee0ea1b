#include <gtest/gtest.h>

#include <map>
#include <set>

#include "server/place/testing/synthetic_street.h"
#include "server/place/verify.h"

namespace relmap::place {
namespace {

constexpr FrameId kFrame{2, 0};  // another session that passes the street

class ProposeBindings : public testing::Test {
 protected:
  ProposeBindings() : street_(1, 14, 0.5) {
    view_ = SE3::exp((Vector6() << 0.1, 0.05, 0.2, 0.02, -0.03, 0.01).finished());
    features_ = street_.picture(street_.pose(6) * view_, true, points_);
    street_.graph.add_frame(kFrame);
  }
  std::vector<storage::ProposedBinding> propose(const SE3& T_match_frame, double sigma,
                                                std::uint32_t first_maskable = 0) {
    Matrix6 covariance = sigma * sigma * Matrix6::Identity();
    return propose_bindings(street_.graph, {features_, kStreetCamera}, kFrame, kStreetFrame, T_match_frame, covariance,
                            first_maskable);
  }
  std::size_t point_of(const storage::ProposedBinding& binding) const {
    for (std::size_t f = 0; f < features_.size(); ++f)
      if (features_[f].u == binding.u_left && features_[f].v == binding.v) return points_[f];
    return points_.size();
  }

  SyntheticStreet street_;
  SE3 view_;
  std::vector<AppearanceFeature> features_;
  std::vector<std::size_t> points_;
};

TEST_F(ProposeBindings, FindsTheLandmarksInViewAndNoOthers) {
  const auto bindings = propose(view_, 0.01);
  std::size_t in_view = 0;
  for (const std::size_t point : points_) in_view += street_.landmark_of(point).valid();
  EXPECT_GT(bindings.size(), in_view / 2);
  std::set<LandmarkId> landmarks;
  for (const storage::ProposedBinding& binding : bindings) {
    EXPECT_EQ(binding.landmark, street_.landmark_of(point_of(binding)));
    EXPECT_TRUE(landmarks.insert(binding.landmark).second) << "each landmark once";
  }
}

TEST_F(ProposeBindings, AWiderCovarianceToleratesAWorsePose) {
  const SE3 off = view_ * SE3::exp((Vector6() << 0.05, 0.05, 0, 0.02, 0.02, 0).finished());
  const auto narrow = propose(off, 1e-4), wide = propose(off, 0.03);
  EXPECT_GT(wide.size(), 2 * narrow.size() + 20);
  for (const storage::ProposedBinding& binding : wide)
    EXPECT_EQ(binding.landmark, street_.landmark_of(point_of(binding)));
}

TEST_F(ProposeBindings, AWrongPoseBindsNothing) {
  const SE3 wrong = view_ * SE3::exp((Vector6() << 0, 0, 0, 0, 0.3, 0).finished());
  EXPECT_LT(propose(wrong, 0.003).size(), 3u);
}

TEST_F(ProposeBindings, ATrackThatContinuesAnOldLandmarkIsNotBoundAgain) {
  const auto before = propose(view_, 0.01);
  ASSERT_FALSE(before.empty());
  const storage::ProposedBinding& known = before.front();
  street_.graph.edit_warm(kFrame).observations.push_back({known.landmark, {}, known.u_left, known.v, known.u_right, 0});
  for (std::size_t f = 0; f < features_.size(); ++f)
    if (points_[f] == point_of(known)) features_[f].track = 0;
  const auto after = propose(view_, 0.01);
  EXPECT_EQ(after.size(), before.size() - 1);
  for (const storage::ProposedBinding& binding : after) EXPECT_NE(binding.landmark, known.landmark);
}

TEST_F(ProposeBindings, ATrackIsNamed) {
  // A track whose landmark is based in the frame itself, which is what binding is to merge.
  storage::FrameHot hot;
  storage::Landmark own;
  own.track = {0, 0};
  hot.landmarks.push_back(own);
  storage::FrameWarm warm;
  warm.observations.push_back({{kFrame, 0}, {}, features_[0].u, features_[0].v, 0, 0});
  street_.graph.add_frame(kFrame, std::move(hot), std::move(warm));
  std::size_t tracked = 0;
  for (std::size_t f = 0; f < features_.size(); ++f)
    if (street_.landmark_of(points_[f]).valid()) tracked = f;
  features_[tracked].track = 0;
  bool named = false;
  for (const storage::ProposedBinding& binding : propose(view_, 0.01)) {
    const bool is_it = point_of(binding) == points_[tracked];
    EXPECT_EQ(binding.track, is_it ? 0 : -1);
    named |= is_it;
  }
  EXPECT_TRUE(named);
}

TEST_F(ProposeBindings, RecentFramesOfTheOwnSessionAreLeftOut) {
  const QueryPicture query{features_, kStreetCamera};
  const Matrix6 covariance = 1e-4 * Matrix6::Identity();
  EXPECT_TRUE(propose_bindings(street_.graph, query, {1, 13}, kStreetFrame, view_, covariance, 0).empty());
  const auto some = propose_bindings(street_.graph, query, {1, 13}, kStreetFrame, view_, covariance, 5);
  EXPECT_FALSE(some.empty());
  for (const storage::ProposedBinding& binding : some) EXPECT_LT(binding.landmark.base.index, 5u);
}

}  // namespace
}  // namespace relmap::place
