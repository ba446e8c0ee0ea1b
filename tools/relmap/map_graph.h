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
  std::set<FrameId> frames;
  std::vector<client::Edge> edges;  // between those frames, of every state
  std::size_t mono_sessions = 0;    // left out: nothing connects their frames, which have no scale

  std::vector<SessionNumber> sessions() const;
};

inline bool in_graph(const client::Edge& edge) { return edge.state == client::EdgeState::kAccepted && edge.carries; }

struct GraphChoice {
  std::vector<std::string> sessions;  // numbers or names; empty: all except mono sessions
  std::size_t max_frames = 0;         // more are refused, since relaxation would take too long
  std::string advice;                 // what to do if there are more: "choose sessions with --only"
};
// With more frames a picture shows nothing useful, and relaxation takes minutes.
inline constexpr std::size_t kMaxRelaxedFrames = 200000;

// "3 mono sessions (photographs) have no scale of their own and are not drawn"; `done` is "drawn".
std::string not_placed_text(std::size_t mono_sessions, const std::string& done);
// The refusal of a graph without frames (EMPTY_MAP): "there is nothing to draw", and how many mono sessions there are.
// `verb` is "draw", `done` is "drawn".
Status nothing_to_place(const MapGraph& graph, const std::string& verb, const std::string& done);

// Reads the graph of the chosen sessions. NO_SUCH_SESSION; NOT_STEREO if a mono session was chosen; BUDGET_EXCEEDED if
// there are more than `max_frames` frames.
Result<MapGraph> read_map_graph(const GraphChoice& choice, client::Client& client, terminal::Console& console);

}  // namespace relmap::cli
