// A recording in KITTI's layout that relmap-frontend has streamed over LCM to relmapd, with access to the map.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontend/tracking/drift.h"
#include "storage/map/map.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/drive_evaluation.h"
#include "tests/support/running_daemon.h"

namespace relmap::testing {

class StreamedDrive {
 public:
  // Streams the recording, as fast as possible or at `rate_hz` pairs a second, and waits until the map is idle. Throws
  // if anything fails, or if the front-end does not end with `exit_code`.
  explicit StreamedDrive(const std::string& recording, double rate_hz = 0, int exit_code = 0);

  // A number of the front-end's summary.
  double summary(const std::string& key) const;
  const std::string& summary_json() const { return summary_; }
  client::Client& client() { return *client_; }
  const client::Session& session() const { return session_; }
  const DriveTruth& truth() const { return truth_; }

  // A stereo pair of the recording as a query.
  client::View view(std::size_t pair) const;
  // The true pose of a pair in the coordinates of a frame of the map.
  SE3 true_T_frame_pair(FrameId frame, std::size_t pair) const;
  // The last keyframe; the keyframe nearest in time to a pair.
  FrameId last() const { return {session_.number, session_.last}; }
  FrameId frame_near(std::size_t pair) const;
  // The pair that became a keyframe.
  std::size_t pair_of(FrameId frame) const;
  // Metres along the recording between two pairs.
  double metres_between(std::size_t first, std::size_t second) const;

  // Stops the daemon, and opens its map.
  storage::Map& stop();
  // Poses of the session's keyframes beside the truth: by the front-end's odometry, and by chaining the map's edges
  // from the first keyframe.
  std::vector<tracking::PosePair> odometry_chain() const;
  std::vector<tracking::PosePair> map_chain() const;

 private:
  std::string picture(const char* eye, std::size_t pair) const;

  const std::string recording_;
  const storage::TemporaryFolder folder_;
  const DriveTruth truth_;
  std::string summary_;
  std::unique_ptr<RunningDaemon> daemon_;
  std::unique_ptr<client::Client> client_;
  client::Session session_;
  std::vector<std::int64_t> frame_times_;  // by index, since the first
  std::unique_ptr<storage::Map> map_;
};

}  // namespace relmap::testing
