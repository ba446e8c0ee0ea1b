#include "tests/support/streamed_sessions.h"

#include <future>
#include <stdexcept>

#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

std::string run_to_end(const std::vector<std::string>& command, int exit_code = 0) {
  const Finished streamed = run_program(command, std::chrono::minutes(3));
  if (streamed.exit_code != exit_code) throw std::runtime_error("relmap-frontend: " + streamed.standard_error);
  return streamed.standard_output;
}

}  // namespace

StreamedSessions::StreamedSessions(const std::vector<std::string>& more, int first)
    : daemon_(std::make_unique<RunningDaemon>(DaemonOptions{.data = folder_ / "map", .lcm = lcm_, .more = more})),
      client_(daemon_->client()),
      next_(first) {}

std::vector<std::string> StreamedSessions::command(const std::string& source, const std::string& recording,
                                                   const std::string& robot) {
  const std::string number = std::to_string(next_++);
  const std::string uuid = "00000000-0000-4000-8000-" + std::string(12 - number.size(), '0') + number;
  return {built_program("relmap-frontend"),
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
}

std::string StreamedSessions::stream(const std::string& source, const std::string& recording, const std::string& robot,
                                     const std::vector<std::string>& more, int exit_code) {
  std::vector<std::string> arguments = command(source, recording, robot);
  arguments.insert(arguments.end(), more.begin(), more.end());
  const std::string summary = run_to_end(arguments, exit_code);
  if (const Status idle = client_->wait_idle(); !idle.ok()) throw StatusError(idle);
  return summary;
}

void StreamedSessions::stream_together(const std::string& source,
                                       const std::vector<std::pair<std::string, std::string>>& recordings_and_robots) {
  std::vector<std::future<std::string>> streams;
  for (const auto& [recording, robot] : recordings_and_robots)
    streams.push_back(std::async(std::launch::async, run_to_end, command(source, recording, robot), 0));
  for (auto& stream : streams) stream.get();
  if (const Status idle = client_->wait_idle(); !idle.ok()) throw StatusError(idle);
}

storage::Map& StreamedSessions::stop() {
  if (!doubts_expected_)
    for (const client::DoubtfulCamera& camera : client_->status().or_throw().doubtful_cameras)
      throw std::runtime_error("the camera of " + camera.robot + " is in doubt: " + camera.message);
  client_.reset();
  if (daemon_->stop() != 0) throw std::runtime_error("relmapd did not stop well: " + daemon_->log());
  map_ = open_stored_map(folder_ / "map");
  return *map_;
}

}  // namespace relmap::testing
