// The map laid out for drawing: points of its skeleton in one plane, and the loop closures between them. An immutable
// value once it is made (make_layout.h), of about 70 bytes a point: a map of a million frames has 72,000.
//
// The world: metres, x to the right and y up the page, seen from above; z comes towards the viewer. Parts of the map
// that nothing connects lie side by side.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/map_types.h"
#include "client/tear.h"

namespace relmap::console {

// Of the step to a point from the one before, and of the point itself.
enum PointFlag : std::uint8_t {
  kUnmeasured = 1,   // the motion is a guess
  kCarried = 2,      // the robot was carried
  kCut = 4,          // no frame, but where a line was cut at the edge of a tile
  kSessionEnd = 8,   // the first or the last frame of its session
  kNotPulling = 16,  // the step is doubtful, and measured edges connect its ends; not told to the page
};

struct LayoutBox {
  Vector2 low = Vector2::Zero(), high = Vector2::Zero();

  Vector2 size() const { return high - low; }
  bool operator==(const LayoutBox&) const = default;
};

struct MapLayout {
  // A kept frame, and the step to it from the point before; of the first point of a run there is none.
  struct Point {
    Vector3 position = Vector3::Zero();  // in the world
    std::array<float, 3> rotation{};     // from the camera to the world, a rotation vector
    std::uint32_t index = 0;             // of the frame in its session
    std::uint32_t time_s = 0;            // UTC; 0: not known
    std::uint32_t frames = 0;            // contracted into the step, this one included
    float translation_variance = 0;      // the traces of the step's covariance, m^2 and rad^2
    float rotation_variance = 0;         //
    float importance = 0;                // metres, see line_importance.h
    std::uint8_t flags = 0;              // PointFlag
  };
  // Points that motion joins, of one session and ascending: those from `first` to before `end`.
  struct Run {
    SessionNumber session = 0;
    std::uint32_t first = 0, end = 0;
    std::uint32_t part = 0;
  };
  struct Closure {
    EdgeId id;
    FrameId a;                         // the older end; the newer one is id.frame
    std::uint32_t at_a = 0, at_b = 0;  // its ends as points
    client::EdgeState state = client::EdgeState::kCandidate;
    bool carries = false;  // it is an edge of the graph while it is accepted
    std::uint32_t alike = 1;
    float suspicion = 0;  // 0..1
    float sigmas = 0;     // by how many standard deviations the layout stretches it; 0: its ends are in different parts
    float translation_variance = 0, rotation_variance = 0;

    bool in_force() const { return state == client::EdgeState::kAccepted && carries; }
    bool torn() const { return in_force() && sigmas > client::kTearSigmas; }
  };
  struct Part {
    FrameId root;
    std::uint64_t frames = 0;
    LayoutBox box;
    std::vector<SessionNumber> sessions;  // ascending
  };
  // Where a frame is.
  struct Place {
    std::uint32_t run = 0;
    std::uint32_t point = 0;  // the first point of the run at the frame or after it
    Vector3 position = Vector3::Zero();
    Matrix3 rotation = Matrix3::Identity();  // from the camera to the world

    // The directions of an axis of the camera in the plane: radians, 0 along x, counter-clockwise.
    double heading() const;  // in which it looks
    double x_axis() const;
  };

  // What it is of.
  MapIdentity map;
  std::string boot_id;              // of the daemon that told the skeleton
  std::uint64_t map_version = 0;    // of that daemon
  std::uint64_t commit_number = 0;  // of the stored map
  std::uint64_t version = 0;        // of the layout: grows from one to the next, also over restarts of the console
  std::uint32_t level = 0;          // of the skeleton
  bool coarse = false;              // a better one is being made
  bool converged = true;
  double seconds = 0;  // that it took to make

  std::uint64_t frames = 0;
  std::int64_t first_ms = 0, last_ms = 0;  // UTC, of frames whose time is known; 0: of none
  std::vector<Point> points;               // of all runs, ascending by frame
  std::vector<Run> runs;                   // ascending
  std::vector<Closure> closures;           // ascending by id
  std::vector<Part> parts;                 // the largest first
  std::vector<client::Tear> torn;          // the worst first, at most kMaxTorn
  std::uint64_t torn_in_all = 0;

  // The square that all lies in; its side is a power of two. Tiles divide it.
  Vector2 corner = Vector2::Zero();  // lower left
  double size = 1;
  std::uint32_t zooms = 0;  // at which every point is drawn

  static constexpr std::size_t kMaxTorn = 200;

  // The run that goes over a frame; null: none does.
  const Run* run_of(FrameId frame) const;
  // Between points positions lie on the line that is drawn, in proportion to the frames.
  std::optional<Place> place(FrameId frame) const;
  FrameId frame_of(const Run& run, std::uint32_t point) const { return {run.session, points[point].index}; }
  Matrix3 rotation_of(std::uint32_t point) const;
  std::size_t bytes() const;  // of memory
};

}  // namespace relmap::console
