// A hundred stereo pairs of a flight through a room, seconds apart, through the whole server: what it has seen before
// is recognised, bound to the old landmarks, and never taken for another place.
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "frontend/capture/stereo_source.h"
#include "server/map/lookup.h"
#include "tests/support/data_test.h"
#include "tests/support/process.h"
#include "tests/support/streamed_sessions.h"
#include "tests/support/world_truth.h"

namespace relmap::testing {
namespace {

constexpr std::uint32_t kBoundObservations = 20;

// Rows of numbers below a line of names. A double holds nanoseconds of these years to a quarter of a microsecond.
std::vector<std::vector<double>> read_csv(const std::string& path) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(read_text(path));
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) rows.back().push_back(std::stod(field));
  }
  return rows;
}

std::int64_t microseconds(double ns) { return std::llround(ns / 1000); }

// The rectified left camera in the room, at each picture.
void add_truth(const Graph& graph, const std::string& data, WorldTruth& truth) {
  const auto source = open_euroc(data).or_throw();
  const SE3 T_body_left =
      source->calibration().T_body_left * SE3{source->rectifier().left_rotation().transpose(), Vector3::Zero()};
  bench::DriveTruth drive;
  for (const std::vector<double>& row : read_csv(data + "/gt_body.csv")) {
    drive.time_us.push_back(microseconds(row.at(0)));
    const Eigen::Quaterniond turn(row.at(4), row.at(5), row.at(6), row.at(7));
    drive.poses.push_back(SE3{turn.normalized().toRotationMatrix(), Vector3(row.at(1), row.at(2), row.at(3))} *
                          T_body_left);
  }
  for (std::size_t i = drive.time_us.size(); i-- > 0;) drive.time_us[i] -= drive.time_us[0];
  truth.add(graph, 1, drive);
}

// By the first number of the sessions' identities: what is found must not hang on what is drawn.
class EurocData : public DataTest, public ::testing::WithParamInterface<int> {};

TEST_P(EurocData, WhatAFlightHasSeenBeforeIsRecognisedAndBound) {
  const std::string data = data_ + "/euroc_v101_keyframes100";
  StreamedSessions sessions({"--deterministic"}, GetParam());
  sessions.stream("euroc", data, "drone", {"--all-keyframes"});
  const Graph& map = sessions.stop();
  WorldTruth truth;
  add_truth(map, data, truth);

  std::map<FrameId, Edge> closure_of;
  int wrong = 0, wrong_candidates = 0;
  for (const Edge& edge : edges_of(map, 1)) {
    if (edge.kind != EdgeKind::kLoop) continue;
    closure_of[edge.b] = edge;
    const EdgeError error = truth.error(edge);
    if (!error.wrong) continue;
    (edge.state == EdgeState::kAccepted ? wrong : wrong_candidates)++;
    std::printf("closure %s to %s, state %d, is off by %.2f m and %.1f degrees\n", edge.b.to_string().c_str(),
                edge.a.to_string().c_str(), static_cast<int>(edge.state), error.metres, error.radians * 180 / M_PI);
  }
  EXPECT_EQ(wrong + wrong_candidates, 0);

  // Which picture became which keyframe, and which have shown what an earlier one had shown.
  std::map<std::int64_t, FrameId> frames;
  const Session session = map.session(1).value();
  for (std::uint32_t i = 0; i <= session.last; ++i)
    if (const auto hot = map.hot({1, i})) frames[hot->time_us] = {1, i};
  std::map<std::int64_t, std::string> revisits;
  for (const std::vector<double>& row : read_csv(data + "/revisit_pairs_from_gt.csv")) {
    char pair[80];
    const auto earlier = frames.lower_bound(microseconds(row.at(1)) - 2);
    std::snprintf(pair, sizeof pair, " [%s: %.2f m, %.0f deg]",
                  earlier == frames.end() ? "-" : earlier->second.to_string().c_str(), row.at(2), row.at(3));
    revisits[microseconds(row.at(0))] += pair;
  }
  ASSERT_EQ(revisits.size(), 39u);
  int proposed = 0, bound = 0, verified = 0;  // verified: by a proposal, or re-observations enough for one
  for (const auto& [time, pairs] : revisits) {
    const auto found = frames.lower_bound(time - 2);
    if (found == frames.end() || found->first > time + 2) {
      ADD_FAILURE() << time << " is no keyframe;" << pairs;
      continue;
    }
    const FrameId frame = found->second;
    const std::uint32_t recent = first_recent(map, frame);
    const auto closure = closure_of.find(frame);
    proposed += closure != closure_of.end();
    const std::uint32_t old = observations_of_old(
        map, frame, [&](FrameId base) { return base.session != frame.session || base.index < recent; });
    bound += old >= kBoundObservations;
    verified += closure != closure_of.end() || old >= kBoundObservations;
    std::printf("%s: %s, %u old observations of %zu;%s\n", frame.to_string().c_str(),
                closure == closure_of.end() ? "-" : closure->second.a.to_string().c_str(), old,
                map.warm(frame)->observations.size(), pairs.c_str());
  }
  std::printf(
      "flight: %zu closures, %d wrong, %d wrong candidates; of 39 pictures with an earlier view %d verified: %d by a "
      "closure, %d bound\n",
      closure_of.size(), wrong, wrong_candidates, verified, proposed, bound);
  EXPECT_GE(verified, 36);
  EXPECT_GE(bound, 34);
}

INSTANTIATE_TEST_SUITE_P(Draws, EurocData, ::testing::Values(1, 10061));

}  // namespace
}  // namespace relmap::testing
