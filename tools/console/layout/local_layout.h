// A small piece of the map around a loop closure, laid out with the closure and without it: what would change if it
// were removed, or if it were put into force.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/relmap_client.h"

namespace relmap::console {

struct LocalRequest {
  EdgeId edge;
  double metres = 30;  // around either end, along the map
  // Closures that go with it. Absent: the daemon is asked which ones it would remove with it; where the caller may not
  // ask that, or the closure is not in force, it goes alone.
  std::optional<std::vector<EdgeId>> goes_with = {};
};

struct LocalLayout {
  EdgeId edge;
  FrameId root;                    // the older end: its coordinates are those of both layouts, as seen from above
  bool cut = false;                // more frames are within the distance
  double sigmas = 0;               // by how many standard deviations the layout with the closure stretches it
  double metres = 0, degrees = 0;  // by how much the layout without it contradicts it; 0 if `without` is not joined

  std::vector<FrameId> frames;      // ascending
  std::vector<std::uint32_t> runs;  // positions in `frames` where consecutive frames of a session begin
  struct Laid {
    std::vector<Vector2> at;  // of each frame: x to the right, y up the page, metres
    // The newer end hangs together with the older one. Otherwise nothing says how they lie to each other, and the part
    // with the newer end is drawn where it is in the other layout.
    bool joined = true;
    bool converged = true;
  };
  Laid with, without;
  struct Closure {
    EdgeId id;
    std::uint32_t a = 0, b = 0;  // positions in `frames`
    bool in_force = false;
    bool goes = false;  // it is not in `without`
    double suspicion = 0;
  };
  std::vector<Closure> closures;  // ascending by id
};

// `around`: frames and edges of the graph around both ends of `closure`. NUMERICAL, and the reasons of client::relax().
Result<LocalLayout> lay_out_locally(const client::Edge& closure, std::vector<client::Edge> edges,
                                    std::vector<FrameId> frames, const std::vector<EdgeId>& goes_with);

// Asks the daemon for what lies around the closure. NO_SUCH_EDGE; ODOMETRY_EDGE: it is no closure; INVALID_ARGUMENT:
// the distance is none. The reasons of the client's calls.
inline constexpr std::uint32_t kMaxLocalFrames = 2000;
Result<LocalLayout> local_layout(const LocalRequest& request, client::Client& client);

// As tools/console/README.md has it.
std::string json_of(const LocalLayout& layout);

}  // namespace relmap::console
