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

// Reads the graph of the chosen sessions (numbers or names; none: all except mono sessions). NO_SUCH_SESSION;
// NOT_STEREO if a mono session was chosen.
Result<MapGraph> read_map_graph(const std::vector<std::string>& choice, client::Client& client,
                                terminal::Console& console);

}  // namespace relmap::cli
