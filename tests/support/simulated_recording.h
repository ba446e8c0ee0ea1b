// Pictures of relmap-sim, for tests that stream them.
#pragma once

#include <chrono>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace relmap::testing {

// Makes a recording in `folder` with arguments of `relmap-sim pictures`, and returns the folder. Throws if that fails.
inline std::string record_simulation(const std::string& folder, const std::vector<std::string>& arguments) {
  std::vector<std::string> command{built_program("relmap-sim"), "pictures", "--out", folder};
  command.insert(command.end(), arguments.begin(), arguments.end());
  const Finished done = run_program(command, std::chrono::minutes(2));
  if (done.exit_code != 0) throw std::runtime_error("relmap-sim: " + done.standard_error);
  return folder;
}

// The file name of a pair's pictures in image_0 and image_1; `pair` < 1,000,000.
inline std::string picture_name(int pair) {
  const std::string number = std::to_string(pair);
  return std::string(6 - number.size(), '0') + number + ".png";
}

}  // namespace relmap::testing
