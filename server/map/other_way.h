// What the map says of a loop closure without it: the shortest other way between its ends, over the odometry and other
// closures in force, compared with what the closure measured.
#pragma once

#include <optional>
#include <string>

#include "server/map/consistency.h"
#include "server/route/transform.h"
#include "server/route/work_limit.h"
#include "storage/graph/graph.h"

namespace relmap::map {

struct OtherWay {
  // OK: the way agrees. CONTRADICTS_MOTION: it does not. CARRIED: it does not, and leads along a stretch where the
  // robot was carried, as closures besides this one say. NOT_CONNECTED: there is no other way. OUT_OF_REACH: it is too
  // long, or leads through motion that nothing measured, or is known too badly to tell places apart. NOT_STEREO: the
  // closure measured no metres.
  Reason verdict = Reason::NOT_CONNECTED;
  std::string message;                  // why, with the numbers
  std::optional<route::Transform> way;  // from a to b, if there is one; its covariance includes the odometry's drift
  double metres_apart = 0, radians_apart = 0;  // between what the closure measured and what the way says
  double sigmas_apart = 0;                     // the same as a Mahalanobis distance
};

// Searches at most kOtherWayFrames frames, or as many as `work` allows. What work.proceed returns; throws StatusError
// where reads of the graph do.
inline constexpr std::size_t kOtherWayFrames = std::size_t{1} << 17;
Result<OtherWay> other_way(const storage::Graph& graph, const storage::Edge& closure, const route::WorkLimit& work = {},
                           const ConsistencyRules& rules = {});

}  // namespace relmap::map
