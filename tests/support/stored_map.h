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
// The same; a daemon makes the folder if it is none, and says of which vocabulary the map's words are.
std::unique_ptr<storage::Map> make_stored_map(const std::string& folder);

// The keyframes of a file that relmap-sim or relmap-frontend wrote. Throws StatusError.
std::vector<Keyframe> read_keyframes(const std::string& file);

// How the single session of the map, beside deleted ones, differs from these keyframes, apart from its uuid and name:
// each line names a frame that is missing, differs, or is there twice. Empty if every keyframe is there once.
std::vector<std::string> settled_once_differences(const storage::Graph& graph, const std::vector<Keyframe>& keyframes);

}  // namespace relmap::testing
