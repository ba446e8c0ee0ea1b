#include "server/place/verify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "proto/geometry/covariance.h"
#include "server/place/testing/synthetic_street.h"

namespace relmap::place {
namespace {

const SE3 kView = SE3::exp((Vector6() << 0.2, -0.1, 0.15, 0.03, -0.08, 0.02).finished());

// The true pose of the view from pose(6) * kView, relative to the frame in which the place was verified.
SE3 truth(const SyntheticStreet& street, const VerifiedPlace& place) {
  return street.pose(place.match.index).inverse() * street.pose(6) * kView;
}

QueryPicture as_query(const std::vector<AppearanceFeature>& features, bool stereo = true) {
  QueryPicture query{features, kStreetCamera};
  if (!stereo) query.camera.baseline = 0;
  return query;
}

TEST(VerifyPlace, FindsTheTransformAndTheLandmarks) {
  SyntheticStreet street(1, 12, 0);
  std::vector<std::size_t> points;
  const auto features = street.picture(street.pose(6) * kView, true, points);
  const auto place = verify_place(street.graph, as_query(features), kStreetFrame, 7);
  ASSERT_TRUE(place.ok()) << place.status().to_string();
  EXPECT_EQ(place->match.session, kStreetFrame.session);
  EXPECT_LE(place->match.index, kStreetFrame.index + 3);
  EXPECT_GE(place->match.index, kStreetFrame.index - 3);
  EXPECT_EQ(place->verification, storage::Verification::kStereo);
  EXPECT_LT((place->T_match_query.inverse() * truth(street, *place)).log().norm(), 1e-3);
  EXPECT_GT(place->inliers, 50u);
  EXPECT_GT(place->spread, 0.15);
  EXPECT_GT(place->bindings.size(), 20u);
  std::map<std::pair<float, float>, std::size_t> point_at;
  for (std::size_t f = 0; f < features.size(); ++f) point_at[{features[f].u, features[f].v}] = points[f];
  for (const storage::ProposedBinding& binding : place->bindings) {
    EXPECT_EQ(binding.landmark, street.landmark_of(point_at.at({binding.u_left, binding.v})));
    EXPECT_EQ(binding.track, -1);
    EXPECT_FALSE(std::isnan(binding.u_right));
  }
}

TEST(VerifyPlace, AMonoQueryIsVerified) {
  SyntheticStreet street(2, 12, 0);
  std::vector<std::size_t> points;
  const auto features = street.picture(street.pose(6) * kView, false, points);
  const auto place = verify_place(street.graph, as_query(features, false), kStreetFrame, 7);
  ASSERT_TRUE(place.ok()) << place.status().to_string();
  EXPECT_EQ(place->verification, storage::Verification::kPnP);
  EXPECT_LT((place->T_match_query.inverse() * truth(street, *place)).log().norm(), 1e-3);
  ASSERT_FALSE(place->bindings.empty());
  EXPECT_TRUE(std::isnan(place->bindings[0].u_right));
}

TEST(VerifyPlace, TheCovarianceAllowsForTheRotationBetweenTheEyes) {
  SyntheticStreet street(3, 12, 0.5);
  std::vector<std::size_t> points;
  const auto features = street.picture(street.pose(6) * kView, false, points);
  QueryPicture query = as_query(features, false);
  const auto left = verify_place(street.graph, query, kStreetFrame, 7);
  query.eye_turn = Vector3(0.01, 0.03, 0);
  const auto either = verify_place(street.graph, query, kStreetFrame, 7);
  ASSERT_TRUE(left.ok() && either.ok());
  const Matrix3 more = (either->covariance - left->covariance).bottomRightCorner<3, 3>();
  EXPECT_LT((more - query.eye_turn * query.eye_turn.transpose() / 2).norm(), 1e-12);
}

TEST(VerifyPlace, AnUnknownFocalLengthIsEstimated) {
  SyntheticStreet street(2, 12, 0.3);
  std::vector<std::size_t> points;
  const auto features = street.picture(street.pose(6) * kView, false, points);
  QueryPicture query{features, kStreetCamera};
  query.camera.f = query.camera.baseline = 0;
  const auto place = verify_place(street.graph, query, kStreetFrame, 7);
  ASSERT_TRUE(place.ok()) << place.status().to_string();
  EXPECT_EQ(place->verification, storage::Verification::kPnP);
  EXPECT_NEAR(place->focal_length / kStreetCamera.f, 1, 0.02);
  EXPECT_LT((place->T_match_query.inverse() * truth(street, *place)).t.norm(), 0.1);
  const auto known = verify_place(street.graph, as_query(features, false), kStreetFrame, 7);
  EXPECT_GE(place->covariance(2, 2), known->covariance(2, 2)) << "with an unknown lens the depth is less certain";
}

// Features that are close together and coarse agree with very different poses, so anything that looks a little like the
// place would be recognised as it.
TEST(VerifyPlace, InliersThatDoNotDetermineTheRotationAreRefused) {
  SyntheticStreet street(2, 12, 0);
  std::vector<std::size_t> points;
  std::vector<AppearanceFeature> features = street.picture(street.pose(6) * kView, false, points);
  const float max_u = 0.62F * kStreetCamera.width, max_v = 0.7F * kStreetCamera.height;
  const float min_u = 0.3F * kStreetCamera.width, min_v = 0.3F * kStreetCamera.height;
  std::erase_if(features,
                [&](const AppearanceFeature& f) { return f.u < min_u || f.u > max_u || f.v < min_v || f.v > max_v; });
  features.resize(24);
  const auto place = verify_place(street.graph, as_query(features, false), kStreetFrame, 7);
  ASSERT_TRUE(place.ok()) << place.status().to_string();
  for (AppearanceFeature& f : features) f.scale = 160;  // sigmas of 32 pixels
  const auto coarse = verify_place(street.graph, as_query(features, false), kStreetFrame, 7);
  EXPECT_EQ(coarse.reason(), Reason::POOR_SPREAD) << coarse.status().to_string();
  EXPECT_NE(coarse.status().message().find("rotation"), std::string::npos) << coarse.status().message();
}

// Coarse features in a row: turned about the row by any angle, the camera sees nearly the same.
TEST(VerifyPlace, TheRefusalHasNoFigureWhereAnyRotationFits) {
  HandMadeGraph graph;
  graph.add_session(1, kStreetCamera);
  std::mt19937_64 random(1);
  std::vector<AppearanceFeature> features;
  for (int i = 0; i < 40; ++i) {
    AppearanceFeature& f = features.emplace_back();
    f.u = static_cast<float>(20 + 12 * i);
    f.v = static_cast<float>(190 + i % 3);
    f.disparity = 30;
    f.scale = 5;
    for (auto& byte : f.descriptor) byte = static_cast<std::uint8_t>(random() % 90);
  }
  storage::FrameCold cold;
  cold.appearance = features;
  graph.add_frame({1, 0}, {}, {}, std::move(cold));
  for (AppearanceFeature& f : features) f.scale = 160;  // sigmas of 32 pixels
  const auto row = verify_place(graph, as_query(features), {1, 0}, 7);
  EXPECT_EQ(row.reason(), Reason::POOR_SPREAD) << row.status().to_string();
  EXPECT_NE(row.status().message().find(" inliers do not tell the rotation; "), std::string::npos)
      << row.status().message();
}

// Mean normalised squared error of the transform, which is 6 if the covariance is right.
double mean_nees(bool stereo, int trials) {
  double sum = 0;
  for (int trial = 0; trial < trials; ++trial) {
    SyntheticStreet street(100 + static_cast<std::uint64_t>(trial), 12, 1, 250);
    std::vector<std::size_t> points;
    const auto features = street.picture(street.pose(6) * kView, stereo, points);
    const auto place = verify_place(street.graph, as_query(features, stereo), kStreetFrame, 7);
    EXPECT_TRUE(place.ok()) << place.status().to_string();
    if (!place.ok()) continue;
    const Vector6 error = (truth(street, *place).inverse() * place->T_match_query).log();
    sum += mahalanobis_squared(error, place->covariance) / trials;
  }
  return sum;
}

TEST(VerifyPlace, CovarianceIsHonestWithTwoEyes) {
  const double nees = mean_nees(true, 40);
  EXPECT_GT(nees, 4.0);
  EXPECT_LT(nees, 8.5);
}

TEST(VerifyPlace, CovarianceIsHonestWithOneEye) {
  const double nees = mean_nees(false, 40);
  EXPECT_GT(nees, 4.0);
  EXPECT_LT(nees, 8.5);
}

// Most points have a look-alike, so that hardly any is recognised by its descriptor alone, but each is where the pose
// predicts it.
class VerifyLookAlikes : public testing::Test {
 protected:
  VerifyLookAlikes() {
    features_ = street_.picture(street_.pose(6) * kView, true, points_);
    for (std::size_t k = 0; k < points_.size(); ++k) looks_[points_[k]] = k < kUnlike ? k : kUnlike + (k - kUnlike) / 2;
    paint(features_, points_);
    for (std::uint32_t i = 0; i < 12; ++i) {
      std::vector<std::size_t> seen;
      street_.picture(street_.pose(i), true, seen);
      paint(street_.graph.edit_cold({1, i}).appearance, seen);
    }
  }
  void paint(std::vector<AppearanceFeature>& features, const std::vector<std::size_t>& points) const {
    for (std::size_t f = 0; f < features.size(); ++f) {
      const auto looks = looks_.find(points[f]);
      if (looks == looks_.end()) continue;
      std::mt19937_64 random(looks->second);
      for (auto& byte : features[f].descriptor) byte = static_cast<std::uint8_t>(random() % 90);
    }
  }
  Result<VerifiedPlace> verify(std::size_t features) const {
    QueryPicture query = as_query(features_);
    query.features = query.features.first(features);
    return verify_place(street_.graph, query, kStreetFrame, 7);
  }

  static constexpr std::size_t kUnlike = 17;  // fewer than kMinInliers
  SyntheticStreet street_{12, 12, 0};
  std::vector<std::size_t> points_;
  std::vector<AppearanceFeature> features_;
  std::map<std::size_t, std::size_t> looks_;
};

TEST_F(VerifyLookAlikes, FewInliersAreEnoughWhereManyMoreAreFoundNearTheirPrediction) {
  ASSERT_GT(features_.size(), 60u);
  const auto place = verify(features_.size());
  ASSERT_TRUE(place.ok()) << place.status().to_string();
  EXPECT_GT(place->inliers, 50u);
  EXPECT_LT((place->T_match_query.inverse() * truth(street_, *place)).log().norm(), 1e-3);
}

TEST_F(VerifyLookAlikes, FewInliersAreRefusedWhereOnlyAFewMoreAreFound) {
  const auto place = verify(27);
  ASSERT_FALSE(place.ok());
  EXPECT_EQ(place.reason(), Reason::TOO_FEW_INLIERS);
}

// A quarter of the features have the same word whenever they are seen; the others have another one in each picture. The
// frame that is tried shows some of them only, so that this or the next step has to tell the place.
class VerifyByWords : public testing::Test {
 protected:
  static constexpr std::size_t kSame = 4;      // one in so many has the same word
  static constexpr std::size_t kNone = 10000;  // none has

  VerifyByWords() {
    features_ = street_.picture(street_.pose(6) * kView, true, points_);
    for (std::uint32_t i = 0; i < 12; ++i) {
      std::vector<std::size_t> seen;
      street_.picture(street_.pose(i), true, seen);
      street_.graph.edit_cold({1, i}).words = words_of(seen, i, kSame);
    }
  }
  static std::vector<std::uint32_t> words_of(const std::vector<std::size_t>& points, std::uint32_t picture,
                                             std::size_t one_in) {
    std::vector<std::uint32_t> words;
    for (const std::size_t point : points) {
      const auto of_point = static_cast<std::uint32_t>(point);
      words.push_back(point % one_in == 1 ? of_point : 100000 * (picture + 1) + of_point);
    }
    return words;
  }
  // Of what the query sees, leaves `shown` features in the frame that is tried. If they are `mixed_up`, each looks like
  // another one.
  void show(std::size_t shown, bool mixed_up = false) {
    std::vector<std::size_t> points;
    street_.picture(street_.pose(kStreetFrame.index), true, points);
    auto& there = street_.graph.edit_cold(kStreetFrame).appearance;
    std::vector<AppearanceFeature*> kept;
    for (std::size_t f = 0; f < points.size(); ++f) {
      if (kept.size() < shown && std::ranges::find(points_, points[f]) != points_.end())
        kept.push_back(&there[f]);
      else
        there[f].descriptor.fill(static_cast<std::uint8_t>(200 + f % 50));
    }
    ASSERT_EQ(kept.size(), shown);
    for (std::size_t k = 0; mixed_up && k + 1 < kept.size(); ++k)
      std::swap(kept[k]->descriptor, kept[k + 1]->descriptor);
  }
  Result<VerifiedPlace> verify(std::size_t one_in) const {
    QueryPicture query = as_query(features_);
    const auto words = words_of(points_, 99, one_in);
    query.words = words;
    return verify_place(street_.graph, query, kStreetFrame, 7);
  }
  void expect_found(const Result<VerifiedPlace>& place) const {
    ASSERT_TRUE(place.ok()) << place.status().to_string();
    EXPECT_LT((place->T_match_query.inverse() * truth(street_, *place)).log().norm(), 1e-3);
    EXPECT_EQ(place->inliers, verify_place(street_.graph, as_query(features_), kStreetFrame, 7)->inliers)
        << "as by all pairs";
  }

  SyntheticStreet street_{12, 12, 0};
  std::vector<std::size_t> points_;
  std::vector<AppearanceFeature> features_;
};

TEST_F(VerifyByWords, WhatLittleTheFrameShowsIsEnoughWithWords) {
  show(10);
  expect_found(verify(kSame));
  EXPECT_EQ(verify(kNone).reason(), Reason::TOO_FEW_INLIERS) << "without words it is not";
}

TEST_F(VerifyByWords, AFrameThatLooksTooLittleLikeTheQueryEndsTheTrial) {
  show(7);
  EXPECT_EQ(verify(kSame).reason(), Reason::TOO_FEW_INLIERS);
}

TEST_F(VerifyByWords, AllPairsAreMatchedWhereTheFrameLooksLikeTheQueryButNoPoseIsFound) {
  show(18, true);
  expect_found(verify(kNone));
}

TEST_F(VerifyByWords, APointIsCountedOnceThoughItIsDescribedTwice) {
  show(10);
  const auto once = verify(kSame);
  const std::size_t count = features_.size();
  for (std::size_t f = 0; f < count; ++f) {  // as SIFT does where it sees two orientations
    features_.push_back(features_[f]);
    points_.push_back(points_[f]);
  }
  const auto twice = verify(kSame);
  ASSERT_TRUE(once.ok() && twice.ok());
  EXPECT_LE(twice->inliers, once->inliers);
}

TEST_F(VerifyByWords, AnotherStreetIsRefusedByItsFrameAlone) {
  SyntheticStreet other(4, 12, 0.5);
  std::vector<std::size_t> points;
  const auto features = other.picture(other.pose(6) * kView, true, points);
  QueryPicture query = as_query(features);
  const auto words = words_of(points, 99, kSame);
  query.words = words;
  const auto place = verify_place(street_.graph, query, kStreetFrame, 7);
  EXPECT_EQ(place.reason(), Reason::TOO_FEW_INLIERS);
  EXPECT_NE(place.status().message().find("features look like that frame's"), std::string::npos)
      << place.status().message();
}

TEST(VerifyPlace, AnotherStreetIsRefused) {
  SyntheticStreet street(3, 12, 0.5), other(4, 12, 0.5);
  std::vector<std::size_t> points;
  const auto features = other.picture(other.pose(6) * kView, true, points);
  EXPECT_EQ(verify_place(street.graph, as_query(features), kStreetFrame, 7).reason(), Reason::TOO_FEW_INLIERS);
}

TEST(VerifyPlace, ARefusalNamesWhatIsMissing) {
  SyntheticStreet street(5, 12, 0);
  std::vector<std::size_t> points;
  auto features = street.picture(street.pose(6), true, points);
  EXPECT_EQ(verify_place(street.graph, as_query(features), {1, 99}, 7).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(verify_place(street.graph, as_query(features), {9, 1}, 7).reason(), Reason::NO_SUCH_FRAME);
  std::vector<AppearanceFeature> corner;
  for (const AppearanceFeature& feature : features)
    if (feature.u < 120 && feature.v < 96) corner.push_back(feature);
  // A small part of the picture says little about the pose, however many features it has.
  while (corner.size() < 25) {
    corner.push_back(corner[corner.size() % 7]);
    corner.back().u += 1;
  }
  EXPECT_FALSE(verify_place(street.graph, as_query(corner), kStreetFrame, 7).ok());
  features.resize(10);
  EXPECT_EQ(verify_place(street.graph, as_query(features), kStreetFrame, 7).reason(), Reason::TOO_FEW_FEATURES);
}

TEST(VerifyPlace, InliersInOneCornerAreRefused) {
  SyntheticStreet street(6, 12, 0, 3000);
  std::vector<std::size_t> points;
  std::vector<AppearanceFeature> corner;
  for (const AppearanceFeature& feature : street.picture(street.pose(6), true, points))
    if (feature.u < 90 && feature.v < 90) corner.push_back(feature);
  ASSERT_GT(corner.size(), 30u);
  EXPECT_EQ(verify_place(street.graph, as_query(corner), kStreetFrame, 7).reason(), Reason::POOR_SPREAD);
}

TEST(VerifyPlace, TheSameSeedGivesTheSameAnswer) {
  SyntheticStreet street(7, 12, 1);
  std::vector<std::size_t> points;
  const auto features = street.picture(street.pose(6) * kView, true, points);
  const auto a = verify_place(street.graph, as_query(features), kStreetFrame, 7);
  const auto b = verify_place(street.graph, as_query(features), kStreetFrame, 7);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->T_match_query.t, b->T_match_query.t);
  EXPECT_EQ(a->T_match_query.R, b->T_match_query.R);
  EXPECT_EQ(a->inliers, b->inliers);
}

TEST(VerifyPlace, AMonoPlaceIsVerifiedByEpipolarGeometry) {
  SyntheticStreet street(8, 12, 0.3);
  std::vector<std::size_t> points;
  HandMadeGraph mono;
  StereoCamera camera = kStreetCamera;
  camera.baseline = 0;
  mono.add_session(5, camera);
  storage::FrameCold cold;
  cold.appearance = street.picture(street.pose(6), false, points);
  mono.add_frame({5, 0}, {}, {}, std::move(cold));
  const auto features = street.picture(street.pose(6) * kView, true, points);
  const auto place = verify_place(mono, as_query(features), {5, 0}, 7);
  ASSERT_TRUE(place.ok()) << place.status().to_string();
  EXPECT_EQ(place->verification, storage::Verification::kEpipolar);
  EXPECT_GE(place->inliers, 30u);
  EXPECT_TRUE(place->bindings.empty());

  SyntheticStreet other(9, 12, 0.3);
  const auto elsewhere = other.picture(other.pose(6), true, points);
  EXPECT_EQ(verify_place(mono, as_query(elsewhere), {5, 0}, 7).reason(), Reason::TOO_FEW_INLIERS);
}

TEST(VerifyPlace, AViewBesideTheCandidateMayConfirmIt) {
  SyntheticStreet street(10, 12, 0.3), other(11, 12, 0.3);
  std::vector<std::size_t> points;
  HandMadeGraph mono;
  StereoCamera camera = kStreetCamera;
  camera.baseline = 0;
  mono.add_session(5, camera);
  for (std::uint32_t i = 0; i < 4; ++i) {
    storage::FrameCold cold;
    cold.appearance =
        i == 2 ? street.picture(street.pose(6), false, points) : other.picture(other.pose(6), false, points);
    mono.add_frame({5, i}, {}, {}, std::move(cold));
  }
  const auto features = street.picture(street.pose(6) * kView, false, points);
  const auto place = verify_place(mono, as_query(features, false), {5, 1}, 7);
  ASSERT_TRUE(place.ok()) << place.status().to_string();
  EXPECT_EQ(place->match, (FrameId{5, 2}));
  EXPECT_EQ(verify_place(mono, as_query(features, false), {5, 0}, 7).reason(), Reason::TOO_FEW_INLIERS);
}

// Where the trial's frame sees a point of the street.
Vector2 seen_at(const SyntheticStreet& street, FrameId frame, std::size_t point) {
  return kStreetCamera.project(street.pose(frame.index).inverse() * street.point(point)).head<2>();
}

TEST(KeptMatches, LieWhereTheirPointsAre) {
  SyntheticStreet street(1, 12, 0);
  std::vector<std::size_t> points;
  std::vector<AppearanceFeature> features = street.picture(street.pose(6) * kView, true, points);
  // Some features look like others' points.
  constexpr std::size_t kExchanged = 24;
  for (std::size_t f = 0; f + 1 < kExchanged; f += 2) std::swap(features[f].descriptor, features[f + 1].descriptor);
  QueryPicture query = as_query(features);
  EXPECT_TRUE(try_place(street.graph, query, kStreetFrame, 7).matches.empty()) << "nobody asked for them";

  query.keep_matches = true;
  const PlaceTrial trial = try_place(street.graph, query, kStreetFrame, 7);
  ASSERT_TRUE(trial.verified.ok()) << trial.verified.status().to_string();
  std::size_t inliers = 0, outliers = 0, beside = 0;
  for (const PointMatch& match : trial.matches) {
    inliers += match.inlier;
    outliers += !match.inlier;
    beside += match.seen_in.valid();
    ASSERT_TRUE(match.residual);
    const double off = (match.pixel - seen_at(street, trial.frame, points[match.feature])).norm();
    if (match.inlier) {
      EXPECT_LT(off, 1);
      EXPECT_LT(*match.residual, 1);
      EXPECT_EQ(outliers, 0u) << "the inliers come first";
    } else {
      EXPECT_LT(match.feature, kExchanged);
      EXPECT_GT(*match.residual, 3);
    }
  }
  EXPECT_EQ(inliers, trial.verified->inliers);
  EXPECT_GT(outliers, 5u);
  EXPECT_GT(beside, 0u) << "frames beside it have seen points, too";
}

TEST(KeptMatches, TellWhatARefusedPlaceHad) {
  SyntheticStreet street(1, 12, 0), other(2, 12, 0);
  std::vector<std::size_t> points;
  std::vector<AppearanceFeature> features = other.picture(other.pose(6), true, points);
  // Another place in which a few things look the same.
  std::vector<std::size_t> here;
  const auto alike = street.picture(street.pose(6), true, here);
  for (std::size_t f = 0; f < 12; ++f) features[f].descriptor = alike[5 * f].descriptor;
  QueryPicture query = as_query(features);
  query.keep_matches = true;
  const PlaceTrial trial = try_place(street.graph, query, kStreetFrame, 7);
  EXPECT_EQ(trial.verified.reason(), Reason::TOO_FEW_INLIERS);
  EXPECT_GE(trial.matches.size(), 8u);
  for (const PointMatch& match : trial.matches) {
    EXPECT_FALSE(match.inlier);
    EXPECT_FALSE(match.residual) << "no transform was found";
  }
}

TEST(KeptMatches, OfAMonoSessionHaveNoMetres) {
  SyntheticStreet street(1, 12, 0);
  street.graph.edit_session(1).header.camera.baseline = 0;
  std::vector<std::size_t> points;
  std::vector<AppearanceFeature> features = street.picture(street.pose(6) * kView, false, points);
  constexpr std::size_t kExchanged = 24;
  for (std::size_t f = 0; f + 1 < kExchanged; f += 2) std::swap(features[f].descriptor, features[f + 1].descriptor);
  QueryPicture query = as_query(features, false);
  query.keep_matches = true;
  const PlaceTrial trial = try_place(street.graph, query, kStreetFrame, 7);
  ASSERT_TRUE(trial.verified.ok()) << trial.verified.status().to_string();
  ASSERT_EQ(trial.verified->verification, storage::Verification::kEpipolar);
  std::size_t inliers = 0, wrong = 0;
  for (const PointMatch& match : trial.matches) {
    EXPECT_FALSE(match.seen_in.valid());
    EXPECT_FALSE(match.residual);
    if (!match.inlier) continue;
    ++inliers;
    wrong += (match.pixel - seen_at(street, trial.frame, points[match.feature])).norm() > 1;
  }
  EXPECT_GE(inliers, 30u);
  EXPECT_LE(wrong, inliers / 20) << "a wrong match may lie on its epipolar line by chance";
  EXPECT_LT(inliers, trial.matches.size());
}

}  // namespace
}  // namespace relmap::place
