#include "tests/support/streamed_sessions.h"

#include <stdexcept>

#include "tests/support/stored_map.h"

namespace relmap::testing {

StreamedSessions::StreamedSessions(const std::vector<std::string>& more)
    : daemon_(std::make_unique<RunningDaemon>(DaemonOptions{.data = folder_ / "map", .lcm = lcm_, .more = more})),
      client_(daemon_->client()) {}

std::string StreamedSessions::stream(const std::string& source, const std::string& recording, const std::string& robot,
                                     const std::vector<std::string>& more) {
  // Numbered, not drawn: the identity seeds what the daemon draws.
  const std::string uuid = "00000000-0000-4000-8000-00000000000" + std::to_string(++streamed_);
  std::vector<std::string> command{built_program("relmap-frontend"),
                                   "--source",
                                   source,
                                   recording,
                                   "--robot",
                                   robot,
                                   "--session",
                                   robot,
                                   "--uuid",
                                   uuid,
                                   "--lcm",
                                   lcm_,
                                   "--spool",
                                   folder_ / ("spool of " + robot),
                                   "--json",
                                   "--quiet"};
  command.insert(command.end(), more.begin(), more.end());
  const Finished streamed = run_program(command, std::chrono::minutes(3));
  if (streamed.exit_code != 0) throw std::runtime_error("relmap-frontend: " + streamed.standard_error);
  if (const Status idle = client_->wait_idle(); !idle.ok()) throw StatusError(idle);
  return streamed.standard_output;
}

Map& StreamedSessions::stop() {
  client_.reset();
  if (daemon_->stop() != 0) throw std::runtime_error("relmapd did not stop well: " + daemon_->log());
  map_ = open_stored_map(folder_ / "map");
  return *map_;
}

}  // namespace relmap::testing
