// Cameras that differ from their calibration, on a simulated street: queries with a wrong calibration are refused,
// unknown lenses are in the covariance of the answer, and a drive with a wrong calibration does not bend the map.
// wrong_questions_data_test and euroc_data_test test the same on recordings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "proto/calibration/calibration.h"
#include "proto/geometry/covariance.h"
#include "tests/support/drive_evaluation.h"
#include "tests/support/other_camera.h"
#include "tests/support/process.h"
#include "tests/support/simulated_recording.h"
#include "tests/support/streamed_sessions.h"
#include "tests/support/world_truth.h"

namespace relmap::testing {
namespace {

using ::testing::AllOf;
using ::testing::Each;
using ::testing::HasSubstr;

constexpr int kPairs = 100;
const std::vector<std::string> kWorld{"--seed", "5",   "--pairs", std::to_string(kPairs),
                                      "--laps", "1.1", "--step",  "0.25"};

std::string drive(const std::string& folder, const std::string& drive_seed) {
  std::vector<std::string> arguments = kWorld;
  arguments.insert(arguments.end(), {"--drive-seed", drive_seed});
  return record_simulation(folder, arguments);
}

std::string picture(const std::string& recording, const std::string& eye, int pair) {
  return read_text(recording + "/" + eye + "/" + picture_name(pair));
}

// calib.txt anew, for a focal length of so many times the true one.
void miscalibrate(const std::string& recording, double factor) {
  const StereoCalibration calibration = load_calibration(recording + "/calib.txt").or_throw();
  const RawCamera& eye = calibration.left;
  const double f = factor * eye.fx;
  char text[400];
  std::snprintf(text, sizeof text, "P0: %f 0 %f 0 0 %f %f 0 0 0 1 0\nP1: %f 0 %f %f 0 %f %f 0 0 0 1 0\n", f, eye.cx, f,
                eye.cy, f, eye.cx, f * calibration.T_right_left.t.x(), f, eye.cy);
  std::ofstream(recording + "/calib.txt") << text;
}

unsigned closures_between(const storage::Graph& map, SessionNumber a, SessionNumber b) {
  unsigned count = 0;
  for (const storage::Edge& edge : edges_of(map, b))
    count += edge.kind == storage::EdgeKind::kLoop &&
             ((edge.a.session == a && edge.b.session == b) || (edge.a.session == b && edge.b.session == a));
  return count;
}

TEST(WrongCamera, QuestionsWithAMistakeAreRefusedByName) {
  const storage::TemporaryFolder folder;
  const std::string recording = drive(folder / "drive", "1");
  StreamedSessions sessions({"--deterministic"});
  sessions.stream("kitti", recording, "car", {"--every", "2"});
  const StereoCamera camera = sessions.client().sessions().or_throw().at(0).camera;
  const auto ask = [&](const std::function<void(client::View&)>& mistake) {
    std::vector<Reason> reasons;
    for (const int pair : {21, 45, 77}) {
      client::View view;
      view.left = picture(recording, "image_0", pair);
      view.right = picture(recording, "image_1", pair);
      view.camera = SessionNumber{1};
      mistake(view);
      reasons.push_back(sessions.client().localise(view).reason());
    }
    return reasons;
  };
  const auto with = [&](const std::function<void(StereoCamera&)>& change) {
    StereoCamera other = camera;
    change(other);
    return [other](client::View& view) { view.camera = other; };
  };
  EXPECT_THAT(ask([](client::View&) {}), Each(Reason::OK));
  EXPECT_THAT(ask([](client::View& view) { view.right.clear(); }), Each(Reason::OK));
  EXPECT_THAT(ask([](client::View& view) { std::swap(view.left, view.right); }), Each(Reason::NOT_STEREO));
  EXPECT_THAT(ask([](client::View& view) { view.right = view.left; }), Each(Reason::NOT_STEREO));
  for (const double factor : {0.8, 1.2}) {
    const auto changed = with([&](StereoCamera& c) { c.f *= factor; });
    EXPECT_THAT(ask(changed), Each(Reason::WRONG_CALIBRATION)) << factor;
    EXPECT_THAT(ask([&](client::View& view) {
                  changed(view);
                  view.right.clear();
                }),
                Each(Reason::WRONG_CALIBRATION))
        << factor << ", one picture";
  }
  EXPECT_THAT(ask(with([](StereoCamera& c) { c.baseline *= 1.3; })), Each(Reason::WRONG_CALIBRATION));
  EXPECT_THAT(ask(with([](StereoCamera& c) { c.cx += 0.06 * c.width; })), Each(Reason::WRONG_CALIBRATION));
}

// A lens that moves the picture's corners in by so much of their distance from the centre; no answer knows of it.
std::vector<double> barrel(const StereoCamera& camera, double share) {
  const double r2 = (camera.cx * camera.cx + camera.cy * camera.cy) / (camera.f * camera.f);
  return {-1.25 * share / r2, 0.25 * share / (r2 * r2), 0, 0, 0};
}

TEST(WrongCamera, PicturesThroughAnUnknownLensHaveHonestCovariances) {
  const storage::TemporaryFolder folder;
  const std::string recording = drive(folder / "drive", "1");
  StreamedSessions sessions({"--deterministic"});
  sessions.stream("kitti", recording, "car", {"--every", "2"});
  const StereoCamera camera = sessions.client().sessions().or_throw().at(0).camera;
  struct Answer {
    double share;
    std::size_t pair;
    client::Localisation found;
  };
  std::vector<Answer> answers;
  int asked = 0;
  for (const double share : {0.1, 0.2})
    for (std::size_t pair = 5; pair < kPairs; pair += 10, ++asked) {
      const std::string seen = picture(recording, "image_0", static_cast<int>(pair));
      const cv::Mat plain = cv::imdecode(std::vector<std::uint8_t>(seen.begin(), seen.end()), cv::IMREAD_GRAYSCALE);
      std::vector<std::uint8_t> file;
      ASSERT_TRUE(cv::imencode(".png", through_lens(plain, camera, barrel(camera, share)), file));
      client::View view;
      view.left.assign(file.begin(), file.end());
      const auto found = sessions.client().localise(view);
      if (found.ok())
        answers.push_back({share, pair, *found});
      else
        std::printf("%.1f, pair %zu: %s\n", share, pair, found.status().to_string().c_str());
    }
  const storage::Graph& map = sessions.stop();
  const DriveTruth truth = read_truth(recording).or_throw();
  WorldTruth world;
  world.add(map, 1, truth);
  double nees = 0;
  for (const auto& [share, pair, found] : answers) {
    const SE3 off = (world.pose(found.frame).inverse() * truth.poses[pair]).inverse() * found.T_frame_view;
    const Vector6 error = off.log();
    const double of_it = mahalanobis_squared(error, found.covariance);
    nees += of_it / static_cast<double>(answers.size());
    std::printf("%.1f, pair %zu: off by %.2f m (sigma %.2f), NEES %.1f, %u inliers\n", share, pair, off.t.norm(),
                std::sqrt(found.covariance.topLeftCorner<3, 3>().trace()), of_it, found.inliers);
  }
  std::printf("%zu of %d answered, mean NEES %.1f\n", answers.size(), asked, nees);
  EXPECT_GE(answers.size(), 5u);
  EXPECT_LE(nees, 15) << "of 6 degrees of freedom";
}

TEST(WrongCamera, ADriveWithAWrongCalibrationJoinsNothingAndIsNamed) {
  const storage::TemporaryFolder folder;
  StreamedSessions sessions({"--deterministic"});
  sessions.stream("kitti", drive(folder / "first", "1"), "first");
  sessions.expect_doubts();
  const std::string wrong = drive(folder / "wrong", "2");
  miscalibrate(wrong, 1.15);
  sessions.stream("kitti", wrong, "wrong");
  sessions.stream("kitti", drive(folder / "second", "3"), "second");
  const auto status = sessions.client().status().or_throw();
  ASSERT_EQ(status.doubtful_cameras.size(), 1u);
  EXPECT_EQ(status.doubtful_cameras[0].session, 2u);
  EXPECT_EQ(status.doubtful_cameras[0].robot, "wrong");
  EXPECT_THAT(status.doubtful_cameras[0].message, HasSubstr("it fits a focal length 1"));
  EXPECT_THAT(status.doubtful_cameras[0].against, ::testing::IsSupersetOf({SessionNumber{1}}));
  // A right camera is answered where the wrong one has been, too.
  for (const int pair : {21, 45, 77}) {
    client::View view;
    view.left = picture(folder / "second", "image_0", pair);
    view.right = picture(folder / "second", "image_1", pair);
    view.camera = SessionNumber{3};
    const auto answer = sessions.client().localise(view);
    ASSERT_TRUE(answer.ok()) << pair << ": " << answer.status().to_string();
    EXPECT_NE(answer->frame.session, 2u);
    StereoCamera neither = sessions.client().sessions().or_throw().at(2).camera;
    neither.f *= 0.8;
    view.camera = neither;
    EXPECT_EQ(sessions.client().localise(view).reason(), Reason::WRONG_CALIBRATION);
    const auto matches = sessions.client().match_image(view).or_throw();
    EXPECT_EQ(matches.nothing_verified.reason(), Reason::WRONG_CALIBRATION) << matches.nothing_verified.to_string();
  }
  const Finished shown = run_program({built_program("relmap"), "--server", sessions.server(), "status"});
  EXPECT_THAT(shown.standard_output,
              AllOf(HasSubstr("needs attention"), HasSubstr("session 2"), HasSubstr("it fits a focal length 1")));
  const storage::Graph& map = sessions.stop();
  std::printf(
      "closures: %u of the first with the wrong one, %u of the second with that, %u of the first and the second\n",
      closures_between(map, 1, 2), closures_between(map, 2, 3), closures_between(map, 1, 3));
  EXPECT_EQ(closures_between(map, 1, 2), 0u);
  EXPECT_EQ(closures_between(map, 2, 3), 0u);
  EXPECT_GT(closures_between(map, 1, 3), 5u);
}

}  // namespace
}  // namespace relmap::testing
