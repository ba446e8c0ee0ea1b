// The kind of input that a run reads. It follows from the options and from what is at their path.
#pragma once

#include <string>

#include "frontend/workflow/outside.h"
#include "frontend/workflow/run_options.h"

namespace relmap::workflow {

// There is one workflow for each.
enum class Input {
  kCamera,       // a live stereo camera
  kPairs,        // a recording of stereo pairs
  kPhotographs,  // pictures of one camera, for a mono session
  kKeyframes,    // a keyframe file, or a folder that has one
  kLog,          // keyframes that lcm-logger recorded
};
Input input_of(const RunOptions& options, const Logs& logs);

// Where the keyframe file is, if there is one: the path itself, or keyframes.bin if the path is a folder.
std::string keyframe_file(const RunOptions& options);

// The last component of the path, which is the default name of a session.
std::string name_of_path(const RunOptions& options);

}  // namespace relmap::workflow
