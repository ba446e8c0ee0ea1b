#include "frontend/workflow/input.h"

#include <filesystem>

#include "frontend/capture/keyframe_file.h"

namespace relmap::workflow {

Input input_of(const RunOptions& options, const Logs& logs) {
  if (options.mono) return Input::kPhotographs;
  const bool any = options.source == "auto";
  if (options.source == "log" || (any && logs.is_log(options.path))) return Input::kLog;
  if ((any || options.source == "sim") && capture::is_keyframe_file(keyframe_file(options))) return Input::kKeyframes;
  return options.source == "iidc" ? Input::kCamera : Input::kPairs;
}

std::string keyframe_file(const RunOptions& options) {
  const std::filesystem::path path = options.path;
  return std::filesystem::is_directory(path) ? (path / "keyframes.bin").string() : path.string();
}

std::string name_of_path(const RunOptions& options) {
  std::filesystem::path path = std::filesystem::path(options.path).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  return path.filename().string();
}

}  // namespace relmap::workflow
