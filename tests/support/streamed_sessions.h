// Recordings of several robots, streamed by relmap-frontend over LCM to one relmapd.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "storage/map/map.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/running_daemon.h"

namespace relmap::testing {

class StreamedSessions {
 public:
  // `more`: arguments of relmapd. The uuids of the sessions are numbers from `first` on, since uuids seed the daemon's
  // random choices.
  explicit StreamedSessions(const std::vector<std::string>& more = {}, int first = 1);

  // Streams a recording, waits until the map is idle, and returns the front-end's summary. Throws if anything fails.
  // `more`: arguments of relmap-frontend; `exit_code`: the expected one.
  std::string stream(const std::string& source, const std::string& recording, const std::string& robot,
                     const std::vector<std::string>& more = {}, int exit_code = 0);
  // Streams several recordings at the same time: pairs of recording and robot.
  void stream_together(const std::string& source,
                       const std::vector<std::pair<std::string, std::string>>& recordings_and_robots);
  client::Client& client() { return *client_; }
  // For `relmap --server`.
  std::string server() const { return folder_ / "map"; }
  // Stops the daemon, and opens its map. Throws if the daemon doubts a calibration, unless expect_doubts() was called.
  storage::Map& stop();
  // To be called if the test streams a wrong calibration, which the daemon will doubt.
  void expect_doubts() { doubts_expected_ = true; }

 private:
  std::vector<std::string> command(const std::string& source, const std::string& recording, const std::string& robot);

  const storage::TemporaryFolder folder_;
  const std::string lcm_ = random_lcm_url();
  std::unique_ptr<RunningDaemon> daemon_;
  std::unique_ptr<client::Client> client_;
  std::unique_ptr<storage::Map> map_;
  int next_;
  bool doubts_expected_ = false;
};

}  // namespace relmap::testing
