#include "server/rpc/view_question.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <random>

#include "frontend/vision/rectify.h"
#include "proto/calibration/calibration_samples.h"
#include "proto/wire/convert.h"
#include "server/place/testing/hand_made_graph.h"

namespace relmap::rpc {
namespace {

constexpr SessionNumber kRectified = 1, kRaw = 2;

std::string picture(int width, int height) {
  std::mt19937 random(1);
  cv::Mat pixels(height, width, CV_8U);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) pixels.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random() % 256);
  std::vector<std::uint8_t> file;
  cv::imencode(".png", pixels, file);
  return {file.begin(), file.end()};
}

class ViewQuestion : public testing::Test {
 protected:
  ViewQuestion() {
    graph_.add_session(kRectified, {300, 159.5, 119.5, 0.12, 320, 240});
    graph_.add_session(kRaw, {310, 159.5, 119.5, 0.12, 320, 240});
    graph_.edit_session(kRaw).header.raw = raw_;
  }
  v1::View question(SessionNumber session, int width = 320, int height = 240) const {
    v1::View view;
    view.mutable_left()->set_data(picture(width, height));
    view.set_session(session);
    return view;
  }

  const StereoCalibration raw_ = sample_raw_calibration(2);
  place::HandMadeGraph graph_;
};

TEST_F(ViewQuestion, APictureOfASessionsCameraIsRectifiedAsItsFrontEndDid) {
  const auto seen = see(question(kRaw), graph_);
  ASSERT_TRUE(seen.ok()) << seen.status().to_string();
  StereoCamera one_eye = vision::Rectifier::make(raw_, 320, 240)->camera();
  one_eye.baseline = 0;
  EXPECT_EQ(seen->camera, one_eye);
}

TEST_F(ViewQuestion, APictureThatIsSaidToBeRectifiedIsNotRectified) {
  v1::View rectified = question(kRaw);
  rectified.set_rectified(true);
  for (const v1::View& view : {rectified, question(kRectified)}) {
    const auto seen = see(view, graph_);
    ASSERT_TRUE(seen.ok()) << seen.status().to_string();
    StereoCamera one_eye = graph_.session(view.session())->header.camera;
    one_eye.baseline = 0;
    EXPECT_EQ(seen->camera, one_eye);
  }
}

TEST_F(ViewQuestion, APictureOfTheRectifiedSizeOnlyIsTakenAsRectified) {
  graph_.edit_session(kRaw).header.camera.width = 300;
  const auto seen = see(question(kRaw, 300, 240), graph_);
  ASSERT_TRUE(seen.ok()) << seen.status().to_string();
  EXPECT_EQ(seen->camera->f, 310);
}

TEST_F(ViewQuestion, TheCameraOfADeletedSessionIsRefused) {
  graph_.edit_session(kRectified).state = storage::SessionState::kDeleting;
  EXPECT_EQ(see(question(kRectified), graph_).reason(), Reason::SESSION_DELETED);
}

TEST_F(ViewQuestion, APictureThatFitsNeitherIsRefusedWithBothSizes) {
  const auto seen = see(question(kRaw, 400, 300), graph_);
  EXPECT_EQ(seen.reason(), Reason::BAD_SIZE);
  for (const char* size : {"400 x 300", "320 x 240"})
    EXPECT_NE(seen.status().message().find(size), std::string::npos) << seen.status().message();
  EXPECT_EQ(see(question(kRectified, 400, 300), graph_).reason(), Reason::BAD_SIZE);
}

TEST_F(ViewQuestion, FeaturesAreOfTheRectifiedCamera) {
  v1::View view;
  view.set_session(kRaw);
  view.mutable_features();
  const auto seen = see(view, graph_);
  ASSERT_TRUE(seen.ok()) << seen.status().to_string();
  EXPECT_EQ(seen->camera, graph_.session(kRaw)->header.camera);
}

TEST_F(ViewQuestion, APictureOfEitherEyeMayBeTurnedUnlessItIsRectified) {
  v1::View view = question(kRaw);
  EXPECT_TRUE(see(view, graph_)->eye_turn.isZero());
  view.set_either_eye(true);
  EXPECT_EQ(see(view, graph_)->eye_turn, vision::Rectifier::make(raw_, 320, 240)->eye_turn());
  EXPECT_GT(see(view, graph_)->eye_turn.norm(), 1e-4);
  view.set_rectified(true);
  EXPECT_TRUE(see(view, graph_)->eye_turn.isZero());
  view.set_rectified(false);
  *view.mutable_camera() = to_wire(graph_.session(kRectified)->header.camera);
  EXPECT_EQ(see(view, graph_).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(ViewQuestion, RectifiedNeedsTheCameraOfASession) {
  v1::View view = question(kRaw);
  view.set_rectified(true);
  *view.mutable_camera() = to_wire(graph_.session(kRectified)->header.camera);
  EXPECT_EQ(see(view, graph_).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(ViewQuestion, APictureCanBeSeenWithoutTheCameraThatWasSupposed) {
  v1::View view = question(kRaw);
  view.set_supposed(true);
  for (const bool rectified : {false, true}) {
    view.set_rectified(rectified);
    view.set_either_eye(!rectified);
    const auto seen = see(without_camera(view), graph_);
    ASSERT_TRUE(seen.ok()) << seen.status().to_string();
    EXPECT_EQ(seen->camera->f, 0);
    EXPECT_NE(seen->known, place::CameraKnown::kSupposed);
    EXPECT_TRUE(seen->eye_turn.isZero());
  }
}

}  // namespace
}  // namespace relmap::rpc
