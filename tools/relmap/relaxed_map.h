// The graph of the map, relaxed into one frame for each part of it that hangs together. A picture of the map, not the
// map: a relative map has no such frame, and its cycles need not close.
//
// What holds poses together is what was measured, each edge by its covariance. A guess of where a robot went while it
// could not see (dead reckoning, a gap) counts, as little as it says of itself, only where no measured edges join its
// ends. A step of which nothing at all is known (the robot may have been carried) holds nothing: frames that only such
// steps would join are different parts, and how they lie to each other is not known. A step along which closures say
// that the robot was carried, whatever its odometry says, holds next to nothing: the closures place what is behind it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/relaxation.h"
#include "tools/relmap/map_graph.h"

namespace relmap::cli {

struct PlacedFrame {
  FrameId frame;
  SE3 T_root_frame;
};

// An edge whose ends the relaxed poses put elsewhere: more than kTearSigmas standard deviations.
struct Tear {
  EdgeId edge;
  FrameId a, b;
  double metres = 0, degrees = 0, sigmas = 0;

  std::string words() const;  // "3:120/1 from 1:4 to 3:120: 0.031 m, 0.10 degrees, 7.3 sigmas"
};
inline constexpr double kTearSigmas = 6;

// A step of a robot that nothing measured, or along which it was carried.
struct DoubtfulStep {
  EdgeId edge;
  FrameId a, b;
  std::string guess;               // of what: "constant velocity", "unsensed", "gap"
  std::vector<EdgeId> carried_by;  // closures that say so; then it is no guess
  double sigma_m = 0;              // standard deviation of a guess, along each axis
  // What else joins its ends.
  enum class Beside : std::uint8_t {
    kUnknown,
    kNothing,    // the part hangs together by this step
    kMeasured,   // measured edges: it matters little
    kNotJoined,  // it holds nothing, and they are in different parts
  };
  Beside beside = Beside::kUnknown;

  std::string words() const;  // "1:39 to 1:40: constant velocity, sigma 0.80 m"
};
// "unknown", "nothing", "measured", "not joined"
const char* name_of(DoubtfulStep::Beside beside);
// Of an edge that nothing measured, or along which the robot was carried; `beside` is not known yet.
DoubtfulStep doubtful_step(const client::Edge& edge);

// Frames that hang together.
struct MapPart {
  FrameId root;                     // in whose coordinates the poses are; one of `frames`
  std::vector<PlacedFrame> frames;  // ascending
  std::vector<std::size_t> edges;   // of RelaxedMap::springs
  std::vector<Tear> tears;          // the worst first
  std::vector<DoubtfulStep> doubtful;
  struct Label {
    FrameId frame;
    std::string text;
  };
  std::vector<Label> labels;

  const SE3* find(FrameId frame) const;  // its pose; null: it is not in the part
  std::vector<SessionNumber> sessions() const;
};

struct RelaxedMap {
  MapGraph graph;
  // Edges as they hold: of the graph's, with the covariance that they count with.
  struct Spring {
    EdgeId edge;
    client::EdgeKind kind = client::EdgeKind::kOdometry;
    bool doubtful = false;  // a step that nothing measured, or along which the robot was carried
    bool pulls = true;      // false: a doubtful one that is left to the measured edges which join its ends
    client::RelaxationEdge relaxed;
  };
  std::vector<Spring> springs;
  std::vector<MapPart> parts;  // the one with the chosen root first, then by number of frames, the largest first

  const std::string& name(SessionNumber session) const { return graph.names.at(session); }
};

// `root`: in whose frame its part is to be; of the others, and if none is chosen, it is the first frame. NO_SUCH_FRAME:
// the graph has no such frame; EMPTY_MAP: it has none at all; and what relaxation.h says.
Result<RelaxedMap> relax_map(MapGraph graph, const std::vector<client::LabelledFrames>& labels,
                             std::optional<FrameId> root = {});

}  // namespace relmap::cli
