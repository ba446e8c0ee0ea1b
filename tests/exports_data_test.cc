// What relmap exports of a recorded flight, against where the camera was. The truth itself is good to about 3.5 cm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "storage/testing/temporary_folder.h"
#include "tests/support/data_test.h"
#include "tests/support/euroc_truth.h"
#include "tests/support/streamed_sessions.h"

namespace relmap::testing {
namespace {

using ::testing::HasSubstr;

struct TimedPosition {
  std::int64_t time_us = 0;
  Vector3 position;
};

std::vector<TimedPosition> read_tum(const std::string& text) {
  std::vector<TimedPosition> out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    long long seconds = 0, microseconds = 0;
    char point = 0;
    Vector3 p;
    EXPECT_TRUE(words >> seconds >> point >> microseconds >> p.x() >> p.y() >> p.z()) << line;
    out.push_back({seconds * 1'000'000 + microseconds, p});
  }
  return out;
}

// Root mean square distance from the truth once the whole is turned and moved onto it, metres; not scaled.
double rmse(const std::vector<TimedPosition>& trajectory, const bench::DriveTruth& truth) {
  Eigen::Matrix3Xd found(3, trajectory.size()), true_positions(3, trajectory.size());
  for (Eigen::Index i = 0; i < found.cols(); ++i) {
    const TimedPosition& at = trajectory[static_cast<std::size_t>(i)];
    const auto pose = bench::truth_at(truth, at.time_us - trajectory.front().time_us);
    EXPECT_TRUE(pose.has_value()) << at.time_us;
    if (!pose) return 1e9;
    found.col(i) = at.position;
    true_positions.col(i) = pose->t;
  }
  const Eigen::Matrix4d aligned = Eigen::umeyama(found, true_positions, false);
  const Eigen::Matrix3Xd moved = (aligned.topLeftCorner<3, 3>() * found).colwise() + aligned.topRightCorner<3, 1>();
  const Eigen::Matrix4d sc = Eigen::umeyama(found, true_positions, true);
  const Eigen::Matrix3Xd ms = (sc.topLeftCorner<3, 3>() * found).colwise() + sc.topRightCorner<3, 1>();
  std::printf("SCALE %.5f rmse %.4f; per axis %.4f %.4f %.4f\n", std::cbrt(sc.topLeftCorner<3, 3>().determinant()),
              std::sqrt((ms - true_positions).colwise().squaredNorm().mean()),
              std::sqrt((moved - true_positions).row(0).squaredNorm() / 100),
              std::sqrt((moved - true_positions).row(1).squaredNorm() / 100),
              std::sqrt((moved - true_positions).row(2).squaredNorm() / 100));
  if (std::getenv("RES"))
    for (Eigen::Index i = 0; i < found.cols(); ++i)
      std::printf("RES %ld %.3f %.3f %.3f  | %.3f\n", i, (moved - true_positions)(0, i), (moved - true_positions)(1, i),
                  (moved - true_positions)(2, i), (moved - true_positions).col(i).norm());
  return std::sqrt((moved - true_positions).colwise().squaredNorm().mean());
}

class ExportsData : public DataTest {};

TEST_F(ExportsData, TheDefaultOfAFlightLiesOnTheTruthAndItsOdometrySaysWhatItGuessed) {
  const std::string data = data_ + "/euroc_v101_keyframes100";
  const TemporaryFolder folder;
  for (int seed : {1}) {
    StreamedSessions sessions({"--deterministic"}, seed);
    sessions.stream("euroc", data, "drone",
                    std::getenv("ALL") ? std::vector<std::string>{"--all-keyframes"} : std::vector<std::string>{});
    const auto exported = [&](std::vector<std::string> more) {
      std::vector<std::string> command{built_program("relmap"), "--server", sessions.server(), "export"};
      command.insert(command.end(), more.begin(), more.end());
      const Finished done = run_program(command);
      EXPECT_EQ(done.exit_code, 0) << done.standard_error;
      return done;
    };
    const bench::DriveTruth truth = read_euroc_truth(data);

    for (const char* v : {"p", "b"}) {
      setenv("VARIANT", v, 1);
      const Finished f = exported({});
      const auto relaxed = read_tum(f.standard_output);
      std::printf("seed %d variant %s: %.4f\n", seed, v, rmse(relaxed, truth));
      std::printf("%s\n", f.standard_error.substr(f.standard_error.find("cost"), 60).c_str());
      if (seed == 1 && *v == 'p') std::printf("%s", f.standard_error.c_str());
    }
  }
}
}  // namespace
}  // namespace relmap::testing
