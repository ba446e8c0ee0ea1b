#include "server/route/beside.h"

#include <queue>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/route/edge_access.h"
#include "server/route/weight.h"

namespace relmap::route {

Result<storage::FrameSet> frames_beside(const storage::Graph& graph, std::span<const FrameId> frames, double metres,
                                        const WorkLimit& work) {
  constexpr storage::Supposed kWithBound{.candidates = false, .quarantined = false, .bound = true};
  constexpr std::size_t kBytesPerFrame = 64;
  using Offer = std::pair<double, FrameId>;
  std::priority_queue<Offer, std::vector<Offer>, std::greater<>> queue;
  std::unordered_map<FrameId, double> distance;
  for (const FrameId frame : frames)
    if (distance.emplace(frame, 0).second) queue.push({0, frame});
  storage::FrameSet beside;
  while (!queue.empty()) {
    const auto [metres_here, frame] = queue.top();
    queue.pop();
    if (metres_here > distance[frame] || beside.contains(frame)) continue;
    if (beside.size() % kWorkStride == 0 && work.proceed)
      if (Status status = work.proceed(distance.size() * kBytesPerFrame + beside.memory_bytes()); !status.ok())
        return status;
    if (beside.size() >= work.max_frames)
      return {Reason::OUT_OF_REACH,
              "more than " + std::to_string(work.max_frames) + " frames lie on the route or beside it"};
    beside.insert(frame);
    const auto hot = graph.hot(frame);
    if (!hot) continue;
    for (const storage::Neighbour& step : storage::neighbours(graph, frame, *hot, kWithBound)) {
      const double there = metres_here + length_m(*EdgeRef(graph, frame, hot, step));
      if (!(there <= metres)) continue;
      const auto [known, is_new] = distance.try_emplace(step.frame, there);
      if (!is_new && known->second <= there) continue;
      known->second = there;
      queue.push({there, step.frame});
    }
  }
  return beside;
}

}  // namespace relmap::route
