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
  // `more`: arguments of relmapd. The sessions' identities are numbers from `first` on: they seed what the daemon
  // draws.
  explicit StreamedSessions(const std::vector<std::string>& more = {}, int first = 1);

  // All of it, until the map is done with it; the front-end's summary. Throws if anything fails on the
  // way. `more`: arguments of relmap-frontend; `exit_code`: what it is to end with.
  std::string stream(const std::string& source, const std::string& recording, const std::string& robot,
                     const std::vector<std::string>& more = {}, int exit_code = 0);
  // All at once; recordings and robots.
  void stream_together(const std::string& source,
                       const std::vector<std::pair<std::string, std::string>>& recordings_and_robots);
  client::Client& client() { return *client_; }
  // For `relmap --server`.
  std::string server() const { return folder_ / "map"; }
  // Stops the daemon; then the map is there to be read. Throws if it doubts the calibration of a session that no test
  // has spoilt.
  storage::Map& stop();
  // One of them is wrong, and the daemon will say so.
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
