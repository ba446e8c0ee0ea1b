// The graph of the map, relaxed into one frame for each connected part. This is a picture of the map, not the map
// itself: a relative map has no such frame, and its cycles need not close.
//
// Edges count in the relaxation as follows:
//   - A measured edge counts with its covariance.
//   - A guess of where a robot went while it could not see (dead reckoning, a gap) counts with its own large
//     covariance, and only if no measured edges connect its ends.
//   - A step of which nothing is known (the robot may have been carried) does not count. Frames that only such steps
//     connect are in different parts, between which no transform is known.
//   - A step along which closures say that the robot was carried counts next to nothing, whatever its odometry
//     says: the closures place what follows it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/relaxation.h"
#include "client/tear.h"
#include "tools/relmap/map_graph.h"

namespace relmap::cli {

struct PlacedFrame {
  FrameId frame;
  SE3 T_root_frame;
};

// A step of a robot that nothing measured, or along which it was carried.
struct DoubtfulStep {
  EdgeId edge;
  FrameId a, b;
  std::string guess;               // what the guess is made of: "constant velocity", "unsensed", "gap"
  std::vector<EdgeId> carried_by;  // closures that say that the robot was carried; then the step is no guess
  double sigma_m = 0;              // standard deviation of a guess along each axis, metres
  // What else connects the ends of the step.
  enum class Beside : std::uint8_t {
    kUnknown,
    kNothing,    // nothing: only this step holds the part together
    kMeasured,   // measured edges, so the step matters little
    kNotJoined,  // nothing, and the step does not count: its ends are in different parts
  };
  Beside beside = Beside::kUnknown;

  std::string words() const;  // "1:39 to 1:40: constant velocity, sigma 0.80 m"
};
// "unknown", "nothing", "measured", "not joined"
const char* name_of(DoubtfulStep::Beside beside);
// Describes an edge that nothing measured, or along which the robot was carried; `beside` is kUnknown.
DoubtfulStep doubtful_step(const client::Edge& edge);

// A connected part of the graph.
struct MapPart {
  FrameId root;                     // the frame of reference of the poses; one of `frames`
  std::vector<PlacedFrame> frames;  // ascending
  std::vector<std::size_t> edges;   // indices into RelaxedMap::springs
  std::vector<client::Tear> tears;  // the worst first
  std::vector<DoubtfulStep> doubtful;
  struct Label {
    FrameId frame;
    std::string text;
  };
  std::vector<Label> labels;

  const SE3* find(FrameId frame) const;  // T_root_frame; null if the frame is not in the part
  std::vector<SessionNumber> sessions() const;
};

struct RelaxedMap {
  MapGraph graph;
  std::vector<client::Spring> springs;  // the edges of the graph that may count in the relaxation
  std::vector<MapPart> parts;           // the one with the chosen root first, then the others, largest first

  bool converged = true;  // false: the relaxation ended before

  const std::string& name(SessionNumber session) const { return graph.names.at(session); }
};

// Relaxes the graph. `root` becomes the root of its part; every other part has its first frame as root. NO_SUCH_FRAME
// if the graph does not have `root`; EMPTY_MAP if it has no frames; and the reasons of client::relax().
Result<RelaxedMap> relax_map(MapGraph graph, const std::vector<client::LabelledFrames>& labels,
                             std::optional<FrameId> root = {});

}  // namespace relmap::cli
