// A recording in KITTI's layout, streamed by relmap-frontend over LCM to relmapd, and what can be asked of the map
// then.
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
  // Streams all of it, as fast as it goes or at so many pairs a second, and waits until the map is done with it. Throws
  // if anything fails on the way, or the front-end does not end with `exit_code`.
  explicit StreamedDrive(const std::string& recording, double rate_hz = 0, int exit_code = 0);

  // Of the front-end's summary.
  double summary(const std::string& key) const;
  const std::string& summary_json() const { return summary_; }
  client::Client& client() { return *client_; }
  const client::Session& session() const { return session_; }
  const DriveTruth& truth() const { return truth_; }

  // A stereo pair of the recording as a question.
  client::View view(std::size_t pair) const;
  // The pose of a pair in the coordinates of a frame of the map, in truth.
  SE3 true_T_frame_pair(FrameId frame, std::size_t pair) const;
  // The keyframe that was taken last; the one nearest in time to a pair.
  FrameId last() const { return {session_.number, session_.last}; }
  FrameId frame_near(std::size_t pair) const;
  // The pair that became a keyframe.
  std::size_t pair_of(FrameId frame) const;
  // Metres along the recording between two pairs.
  double metres_between(std::size_t first, std::size_t second) const;

  // Stops the daemon; then the map is there to be read.
  storage::Map& stop();
  // Of the session's keyframes: the front-end's own odometry, and the map's chain from the first keyframe.
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
