// The exports of a recorded flight against the true poses of the camera, which are accurate to about 3.5 cm.
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
double rmse(const std::vector<TimedPosition>& trajectory, const DriveTruth& truth) {
  Eigen::Matrix3Xd found(3, trajectory.size()), true_positions(3, trajectory.size());
  for (Eigen::Index i = 0; i < found.cols(); ++i) {
    const TimedPosition& at = trajectory[static_cast<std::size_t>(i)];
    const auto pose = truth_at(truth, at.time_us - trajectory.front().time_us);
    EXPECT_TRUE(pose.has_value()) << at.time_us;
    if (!pose) return 1e9;
    found.col(i) = at.position;
    true_positions.col(i) = pose->t;
  }
  const Eigen::Matrix4d aligned = Eigen::umeyama(found, true_positions, false);
  const Eigen::Matrix3Xd moved = (aligned.topLeftCorner<3, 3>() * found).colwise() + aligned.topRightCorner<3, 1>();
  return std::sqrt((moved - true_positions).colwise().squaredNorm().mean());
}

class ExportsData : public DataTest {};

TEST_F(ExportsData, TheDefaultOfAFlightLiesOnTheTruthAndItsChainSaysWhatItGuessed) {
  const std::string data = data_ + "/euroc_v101_keyframes100";
  const storage::TemporaryFolder folder;
  StreamedSessions sessions({"--deterministic"});
  sessions.stream("euroc", data, "drone", {"--all-keyframes"});
  const auto exported = [&](std::vector<std::string> more) {
    std::vector<std::string> command{built_program("relmap"), "--server", sessions.server(), "export"};
    command.insert(command.end(), more.begin(), more.end());
    const Finished done = run_program(command);
    EXPECT_EQ(done.exit_code, 0) << done.standard_error;
    return done;
  };
  const DriveTruth truth = read_euroc_truth(data);

  const std::vector<TimedPosition> relaxed = read_tum(exported({}).standard_output);
  ASSERT_EQ(relaxed.size(), 100u);
  const Finished chained = exported({"--chain"});
  const std::vector<TimedPosition> chain = read_tum(chained.standard_output);
  ASSERT_EQ(chain.size(), 100u);
  const double relaxed_m = rmse(relaxed, truth), chain_m = rmse(chain, truth);
  std::printf("flight: %.3f m from the truth relaxed, %.3f m chained\n", relaxed_m, chain_m);
  EXPECT_LE(relaxed_m, 0.04) << "the truth is good to 3.5 cm";
  EXPECT_GT(chain_m, 0.04) << "or there is nothing that relaxing mends";

  // Pairs are seconds apart, and of one step neither pictures nor landmarks tell.
  EXPECT_THAT(chained.standard_output, HasSubstr("# not measured: "));
  EXPECT_THAT(chained.standard_error, HasSubstr("constant velocity, sigma "));

  // The same poses as those of g2o's vertices.
  std::istringstream lines(exported({"--format", "g2o"}).standard_output);
  std::size_t vertices = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("VERTEX_SE3:QUAT ")) continue;
    std::istringstream words(line.substr(16));
    std::size_t number = 0;
    Vector3 p;
    ASSERT_TRUE(words >> number >> p.x() >> p.y() >> p.z()) << line;
    ASSERT_LT(number, relaxed.size());
    EXPECT_LT((relaxed[number].position - p).norm(), 1e-6) << number;
    ++vertices;
  }
  EXPECT_EQ(vertices, relaxed.size());
}

}  // namespace
}  // namespace relmap::testing
