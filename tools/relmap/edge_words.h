// Edges in words.
#pragma once

#include <string>
#include <vector>

#include "client/map_types.h"

namespace relmap::cli {

// "3:120/1". INVALID_ARGUMENT.
Result<EdgeId> edge_id(const std::string& text);

// Why an edge is in its state; empty where its name says all.
const char* explanation(Reason reason);

// " 3:120/1 3:121/1 ... 3:140/1": at most so many of them, the first and the last.
std::string ids_text(const std::vector<EdgeId>& ids, std::size_t most);

// "frames 3:50..3:70"
std::string stretch_text(FrameId first, FrameId last);
// "through a stretch in which the robot was carried: frames 3:50..3:70, frames ..."; empty: through none.
std::string carried_text(const std::vector<client::CarriedStretch>& stretches);

// "a guess along 3 steps that nothing measured, 9.12 of 9.86 m: frames 3:50..3:53"; empty: there are none.
std::string unmeasured_text(const client::Unmeasured& unmeasured, double distance_m);

// How far the recognised place stands out.
std::string uniqueness_text(const client::Uniqueness& uniqueness);

}  // namespace relmap::cli
