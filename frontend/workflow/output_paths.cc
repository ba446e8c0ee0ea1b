#include "frontend/workflow/output_paths.h"

#include <filesystem>
#include <string>
#include <system_error>

#include "frontend/workflow/input.h"

namespace relmap::workflow {

namespace {

bool is_same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  return !a.empty() && !b.empty() &&
         (std::filesystem::equivalent(a, b, error) ||
          std::filesystem::weakly_canonical(a, error) == std::filesystem::weakly_canonical(b, error));
}

}  // namespace

Status check_output_paths(const RunOptions& options) {
  const std::string* const outputs[] = {&options.out, &options.report, &options.show};
  for (const std::string* output : outputs) {
    for (const std::string& input : {options.path, keyframe_file(options), options.calibration, options.imu})
      if (is_same_file(*output, input))
        return {Reason::INVALID_ARGUMENT, *output + " would be written over the source"};
    for (const std::string* other : outputs)
      if (other != output && is_same_file(*output, *other))
        return {Reason::INVALID_ARGUMENT, *output + " is to be written twice"};
  }
  return {};
}

}  // namespace relmap::workflow
