#include "proto/wire/convert.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "proto/base/crc32c.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert_lcm.h"

namespace relmap {
namespace {

TEST(WireReasons, UnknownNumbersReadAsInternal) {
  EXPECT_EQ(reason_from_wire(to_wire(Reason::NEW_PLACE)), Reason::NEW_PLACE);
  EXPECT_EQ(reason_from_wire(39), Reason::INTERNAL);
  EXPECT_EQ(reason_from_wire(-1), Reason::INTERNAL);
  EXPECT_EQ(reason_from_wire(65536 + 1), Reason::INTERNAL);
}

TEST(WireIds, RoundTrip) {
  const EdgeId id{{3, 4294967295u}, 7};
  EXPECT_EQ(*from_wire(to_wire(id)), id);
  EXPECT_EQ(*from_wire(to_wire(id.frame)), id.frame);
  EXPECT_EQ(from_wire(v1::FrameId()).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(from_wire(v1::EdgeId()).reason(), Reason::INVALID_ARGUMENT);
  const SessionUuid uuid = SessionUuid::random();
  EXPECT_EQ(*uuid_from_wire(uuid_to_wire(uuid)), uuid);
  EXPECT_EQ(uuid_from_wire("short").reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(uuid_from_wire(std::string(16, '\0')).reason(), Reason::INVALID_ARGUMENT);
}

TEST(WireGeometry, TransformsRoundTrip) {
  KeyframeSampler random(5);
  for (int i = 0; i < 100; ++i) {
    const SE3 T = random.pose();
    const auto back = from_wire(to_wire(T));
    ASSERT_TRUE(back.ok());
    EXPECT_LT((back->R - T.R).norm(), 1e-13);
    EXPECT_EQ(back->t, T.t);
  }
}

TEST(WireGeometry, BadTransformsAreRefusedWithTheirReason) {
  EXPECT_EQ(from_wire(v1::Transform()).reason(), Reason::BAD_ROTATION);
  v1::Transform T = to_wire(SE3());
  T.mutable_translation()->set_y(kNaN);
  EXPECT_EQ(from_wire(T).reason(), Reason::NOT_FINITE);
  T = to_wire(SE3());
  T.mutable_rotation()->set_w(2);
  EXPECT_EQ(from_wire(T).reason(), Reason::BAD_ROTATION);
}

TEST(WireGeometry, CovariancesRoundTripAndAreChecked) {
  const Matrix6 m = KeyframeSampler(1).covariance();
  EXPECT_EQ(*from_wire(to_wire(m)), m);
  v1::Covariance wire = to_wire(m);
  wire.set_upper(0, -1);
  EXPECT_EQ(from_wire(wire).reason(), Reason::BAD_COVARIANCE);
  wire.add_upper(1);
  EXPECT_EQ(from_wire(wire).reason(), Reason::BAD_SIZE);
}

TEST(WireCameras, RoundTripAndAreChecked) {
  const StereoCamera camera{400, 256, 192, 0.12, 512, 384};
  EXPECT_EQ(*from_wire(to_wire(camera)), camera);
  v1::Camera wire = to_wire(camera);
  wire.set_width(4294967295u);
  EXPECT_EQ(from_wire(wire).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
}

TEST(WireCameras, RawStereoRoundTripsAndIsChecked) {
  StereoCalibration c;
  c.left = {400, 401, 256, 192, -0.1, 0.01, 1e-4, 2e-4, 0};
  c.right = {402, 403, 255, 191, -0.1, 0.02, 0, 0, 1e-3};
  c.T_right_left.t = {-0.12, 0.001, 0};
  c.width = 512;
  c.height = 384;
  const auto back = from_wire(to_wire(c));
  ASSERT_TRUE(back.ok()) << back.status().to_string();
  EXPECT_EQ(back->left, c.left);
  EXPECT_EQ(back->right, c.right);
  EXPECT_EQ(back->T_right_left.t, c.T_right_left.t);
  EXPECT_EQ(back->width, 512);
  StereoCalibration mono = c;
  mono.right = {};
  EXPECT_TRUE(from_wire(to_wire(mono))->mono());
  c.width = 0;
  EXPECT_EQ(from_wire(to_wire(c)).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
}

TEST(WireFeatures, RoundTripAndAreChecked) {
  const std::vector<AppearanceFeature> features = KeyframeSampler(3).keyframe().appearance;
  const auto back = from_wire(to_wire(features));
  ASSERT_TRUE(back.ok());
  ASSERT_EQ(back->size(), features.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    EXPECT_EQ((*back)[i].u, features[i].u);
    EXPECT_EQ(std::isnan((*back)[i].disparity), std::isnan(features[i].disparity));
    EXPECT_EQ((*back)[i].descriptor, features[i].descriptor);
  }
  v1::FeatureSet wire = to_wire(features);
  wire.mutable_features(0)->set_sift("short");
  EXPECT_EQ(from_wire(wire).reason(), Reason::BAD_SIZE);
  wire = to_wire(features);
  wire.mutable_features(0)->set_disparity(std::numeric_limits<float>::infinity());
  EXPECT_EQ(from_wire(wire).reason(), Reason::NOT_FINITE);
  EXPECT_EQ(from_wire(to_wire(std::vector<AppearanceFeature>(kMaxAppearance + 1))).reason(), Reason::BAD_SIZE);
}

TEST(WirePoses, RoundTripAndAreChecked) {
  KeyframeSampler random(8);
  const SE3 T = random.pose();
  const Matrix6 covariance = random.covariance();
  relmap_lcm::pose_t message{};
  EXPECT_EQ(get_pose(message).reason(), Reason::BAD_ROTATION);
  put_pose(T, covariance, message);
  const auto back = get_pose(message);
  ASSERT_TRUE(back.ok());
  EXPECT_LT((back->T_frame_keyframe.R - T.R).norm(), 1e-13);
  EXPECT_EQ(back->T_frame_keyframe.t, T.t);
  EXPECT_EQ(back->covariance, covariance);
}

}  // namespace
}  // namespace relmap
