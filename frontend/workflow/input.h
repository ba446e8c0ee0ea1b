// What a run reads, told by its options and by what lies at their path.
#pragma once

#include <string>

#include "frontend/workflow/outside.h"
#include "frontend/workflow/run_options.h"

namespace relmap::workflow {

// Each has a workflow of its own.
enum class Input {
  kCamera,       // a live one
  kPairs,        // a recording of stereo pairs
  kPhotographs,  // pictures of one camera, for a mono session
  kKeyframes,    // a file of them, or a folder with one
  kLog,          // keyframes that lcm-logger recorded
};
Input input_of(const RunOptions& options, const Logs& logs);

// Where the path's keyframes are, if it has any: the file itself, or keyframes.bin in the folder.
std::string keyframe_file(const RunOptions& options);

// The last part of the path: what a session is called unless it has another name.
std::string name_of_path(const RunOptions& options);

}  // namespace relmap::workflow
