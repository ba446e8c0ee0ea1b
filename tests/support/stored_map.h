// The map in the folder of a daemon that has stopped, and the keyframes that it was made of.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "proto/keyframe/keyframe.h"
#include "storage/map/map.h"

namespace relmap::testing {

// Throws StatusError.
std::unique_ptr<storage::Map> open_stored_map(const std::string& folder);

// Those of a file that relmap-sim or relmap-frontend wrote. Throws StatusError.
std::vector<Keyframe> read_keyframes(const std::string& file);

// What is wrong with the map if its one session was made of these keyframes, under whatever uuid and name; each line
// names a frame that is missing, another than it should be, or there twice. Empty: every one is there once.
std::vector<std::string> settled_once_differences(const storage::Graph& graph, const std::vector<Keyframe>& keyframes);

}  // namespace relmap::testing
