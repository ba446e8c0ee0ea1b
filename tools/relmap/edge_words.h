// Texts about edges, for tables and messages.
#pragma once

#include <string>
#include <vector>

#include "client/evidence_types.h"
#include "client/map_types.h"

namespace relmap::cli {

// Parses "3:120/1". INVALID_ARGUMENT if `text` is not of that form.
Result<EdgeId> edge_id(const std::string& text);

// Why an edge is in its state, as a clause; empty if the name of the reason says it all.
const char* explanation(Reason reason);

// " 3:120/1 3:121/1 ... 3:140/1": all, or the first and the last ones if there are more than `max_ids`.
std::string ids_text(const std::vector<EdgeId>& ids, std::size_t max_ids);

// "frames 3:50..3:70"
std::string stretch_text(FrameId first, FrameId last);
// "through a stretch in which the robot was carried: frames 3:50..3:70, frames ..."; empty if there are no
// stretches.
std::string carried_text(const std::vector<client::CarriedStretch>& stretches);

// "a guess along 3 steps that nothing measured, 9.12 of 9.86 m: frames 3:50..3:53"; empty if all steps were
// measured.
std::string unmeasured_text(const client::Unmeasured& unmeasured, double distance_m);

// "0.40 contradicted: 3 closures in force contradict it"
std::string doubt_text(const client::Doubt& doubt);
// Those that weigh something when they are rounded to two decimals.
std::vector<client::Doubt> doubts_of(const client::Suspicion& suspicion);
// What the robot's motion says of a closure: "contradicts it (CONTRADICTS_MOTION): the way between its ends ..."
std::string verdict_text(const client::MotionVerdict& verdict);
// "3 closures agree with it: 3:120/1 3:121/1; 1 contradicts it: 4:7/1"; empty: there are neither.
std::string agreements_text(const client::EdgeExplanation& explained);
// Why there are no points that both pictures show.
std::string no_points_text(const Status& missing);

// Whether geometry confirmed a closure here: "verified by pnp: 60 inliers over 40 % of the picture", or why nothing
// says so: "imported with session 3, kitti_00.g2o; not verified here". `session`: that of the closure, as
// session_words() names it.
std::string verification_text(const client::Edge& edge, const std::string& session);
// Whether pictures of the ends were compared, so that the closure has inliers and a probability.
bool was_verified(const client::Edge& edge);

// How clearly the recognised place stands out from other places.
std::string uniqueness_text(const client::Uniqueness& uniqueness);

}  // namespace relmap::cli
