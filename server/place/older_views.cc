#include "server/place/older_views.h"

#include <algorithm>

#include "storage/graph/local_graph.h"
#include "storage/graph/observers.h"

namespace relmap::place {

std::vector<OlderView> older_views(const storage::Graph& graph, FrameId match, const SE3& T_match_query,
                                   const std::function<bool(FrameId)>& left_out) {
  storage::LocalGraph local(graph);
  const std::int32_t root = local.frame(match);
  if (root < 0) return {};
  const storage::TakenIn match_taken_in = storage::taken_in(*local.frames[static_cast<std::size_t>(root)].hot);
  const auto& walk = local.walk_up(root);
  const std::vector<SE3> T_match_node = local.poses_up(root);
  struct View {
    storage::TakenIn age;
    FrameId frame;
    SE3 T_frame_query;
    double distance() const { return T_frame_query.t.norm(); }
  };
  std::vector<View> views;
  for (std::size_t n = 1; n < walk.size(); ++n) {
    const SE3 T_node_query = T_match_node[n].inverse() * T_match_query;
    if (T_node_query.t.norm() > kMaxViewDistance || rotation_angle(T_node_query.R) > kMaxViewAngle) continue;
    const storage::LocalFrame& frame = local.frames[static_cast<std::size_t>(walk[n].frame)];
    if (storage::taken_in(*frame.hot) > match_taken_in || storage::in_one_pass(frame.id, match) || left_out(frame.id))
      continue;
    views.push_back({storage::taken_in(*frame.hot), frame.id, T_node_query});
  }
  std::sort(views.begin(), views.end(), [](const View& l, const View& r) { return l.age < r.age; });

  std::vector<View> nearest;  // the nearest view of each pass
  for (const View& view : views) {
    const auto pass = std::find_if(nearest.begin(), nearest.end(),
                                   [&](const View& other) { return storage::in_one_pass(view.frame, other.frame); });
    if (pass == nearest.end())
      nearest.push_back(view);
    else if (view.distance() < pass->distance())
      *pass = view;
  }
  std::vector<OlderView> oldest;
  for (std::size_t k = 0; k < std::min(nearest.size(), kMaxOlderViews); ++k)
    oldest.push_back({nearest[k].frame, nearest[k].T_frame_query});
  return oldest;
}

}  // namespace relmap::place
