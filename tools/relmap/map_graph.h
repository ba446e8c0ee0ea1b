// The graph of the map, or of some of its sessions, read from the daemon.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "client/relmap_client.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

struct MapGraph {
  std::map<SessionNumber, std::string> names;
  std::map<SessionNumber, StereoCamera> cameras;
  std::map<SessionNumber, client::Session> sessions_by_number;  // those of `names`
  std::set<FrameId> frames;
  std::vector<client::Edge> edges;  // between those frames, of every state
  std::size_t mono_sessions = 0;    // left out: nothing connects their frames, which have no scale

  std::vector<SessionNumber> sessions() const;
};

inline bool in_graph(const client::Edge& edge) { return edge.state == client::EdgeState::kAccepted && edge.carries; }

// "3 mono sessions (photographs) have no scale of their own and are not drawn"; `done` is "drawn".
std::string not_placed_text(std::size_t mono_sessions, const std::string& done);
// The refusal of a graph without frames (EMPTY_MAP): "there is nothing to draw", and how many mono sessions there are.
// `verb` is "draw", `done` is "drawn".
Status nothing_to_place(const MapGraph& graph, const std::string& verb, const std::string& done);

// Reads the graph of the chosen sessions (numbers or names; none: all except mono sessions). NO_SUCH_SESSION;
// NOT_STEREO if a mono session was chosen.
Result<MapGraph> read_map_graph(const std::vector<std::string>& choice, client::Client& client,
                                terminal::Console& console);

}  // namespace relmap::cli
