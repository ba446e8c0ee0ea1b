// The graph of the map, or of some of its sessions, read from the daemon; relaxed, it can be looked at.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "client/relaxation.h"
#include "client/relmap_client.h"
#include "tools/console/console.h"

namespace relmap::cli {

struct MapGraph {
  std::map<SessionNumber, std::string> names;
  std::set<FrameId> frames;
  std::vector<client::Edge> edges;  // between those frames, of every state
};

inline bool in_graph(const client::Edge& edge) { return edge.state == client::EdgeState::kAccepted && edge.carries; }

// `sessions`: numbers or names; none: all. NO_SUCH_SESSION; INVALID_ARGUMENT: more frames than can be relaxed in a
// reasonable time.
Result<MapGraph> read_map_graph(const std::vector<std::string>& sessions, client::Client& client, Console& console);

// By the edges of the graph. What relaxation.h says.
Result<Relaxation> relax(const MapGraph& graph);

}  // namespace relmap::cli
