#include "tools/bench/streaming_robots.h"

#include <filesystem>
#include <stdexcept>

#include "tests/support/running_daemon.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kDrives = 4;  // different ones

// The folder of a drive, which is made unless it is there.
std::string made_drive(const std::string& folder, std::uint32_t number) {
  const std::string path = folder + "/drive-" + std::to_string(number);
  if (std::filesystem::exists(path)) return path;
  const testing::Finished done =
      testing::run_program({testing::built_program("relmap-sim"), "points", "--out", path, "--frames", "2000",
                            "--frames-per-lap", "300", "--appearance", "100", "--seed", std::to_string(number + 1)});
  if (done.exit_code != 0) throw std::runtime_error(done.standard_error);
  return path;
}

}  // namespace

StreamingRobots::StreamingRobots(const std::string& folder, const std::string& server, std::uint32_t count,
                                 double rate_hz) {
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string name = "robot-" + std::to_string(i);
    robots_.push_back(std::make_unique<testing::Process>(
        std::vector<std::string>{testing::built_program("relmap-frontend"), made_drive(folder, i % kDrives), "--robot",
                                 name, "--session", name, "--server", server, "--spool", "none", "--quiet", "--rate",
                                 std::to_string(rate_hz)},
        testing::ProcessOptions{.standard_output = "", .standard_error = folder + "/" + name + ".log"}));
  }
}

}  // namespace relmap::bench
