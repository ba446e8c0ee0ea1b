// Evaluates the map of a drive with known truth: the figures of docs/method.md, 5.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "proto/geometry/geometry.h"
#include "storage/graph/graph.h"

namespace relmap::testing {

// Truth of a recording in KITTI's layout: for each picture the pose of the left camera, in the frame of the first one.
struct DriveTruth {
  std::vector<SE3> poses;
  std::vector<std::int64_t> time_us;  // since the first picture, ascending
};
// Reads FOLDER/poses.txt (or poses_gt.txt) and FOLDER/times.txt (if absent: 10 Hz). NO_SUCH_FILE, CORRUPT.
Result<DriveTruth> read_truth(const std::string& folder);
// The pose of the picture taken within 2 ms of `since_start` (microseconds); nullopt if there is none.
std::optional<SE3> truth_at(const DriveTruth& truth, std::int64_t since_start);

// Whether a closure with this error is wrong: more than 0.5 m or 10 degrees.
bool is_wrong(const SE3& error);
// Whether it is besides off by more than its covariance tells: by more than three sigmas in place or in rotation.
bool is_wrong(const SE3& error, const Matrix6& covariance);

struct DriveEvaluation {
  std::uint32_t keyframes = 0;
  std::uint32_t keyframes_doubled = 0;  // the same payload under two sequences
  std::uint32_t keyframes_without_truth = 0;
  std::uint32_t closures_right = 0;  // accepted
  std::uint32_t closures_wrong = 0;  // accepted, more than 0.5 m or 10 degrees off
  std::uint32_t loop_edges = 0;      // accepted closures that carry an edge
  std::uint32_t revisits = 0;        // keyframes that return to the place of an earlier one
  std::uint32_t revisits_bound = 0;  // those with >= 20 observations of landmarks based in earlier frames
  double registration_error_m = 0;
  double revisit_error_m = 0;  // mean distance between the map's and the true relative position
  double revisit_error_max_m = 0;
  std::uint32_t revisits_disconnected = 0;
};

struct EdgesJudged {
  std::uint32_t right = 0, wrong = 0;  // accepted closures
  double worst_step_m = 0;             // the greatest error of an odometry edge
};
// Judges the edges of a map all of whose sessions are the recording that `truth` is of; also those between sessions.
EdgesJudged judge_edges(const storage::Graph& graph, const DriveTruth& truth);

// Evaluates one session of the map. Truth is assigned to keyframes by the time since the first keyframe.
DriveEvaluation evaluate_drive(const storage::Graph& graph, SessionNumber session, const DriveTruth& truth);

}  // namespace relmap::testing
