// What a route passes: small pictures along the way, and below them how well the position relative to the start is
// known, with the stretches along which robots were carried or nothing measured their motion.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/drawing.h"
#include "client/map_types.h"

namespace relmap::client {

struct RouteStrip {
  // Where the view is shown.
  struct Stop {
    FrameId frame;
    double distance_m = 0, time_s = 0;  // from the start
    std::string picture;                // JPEG or PNG; empty: there is none
    std::string label;                  // of the frame, or empty
  };
  // One way: the cheapest, or an alternative.
  struct Way {
    struct Point {
      double distance_m = 0;
      double sigma_m = 0;  // standard deviation of the position relative to the start: root of the trace
    };
    std::string name;           // "1,204 m, 18 min; the cheapest"
    std::vector<Point> points;  // ascending; at least two, or the profile is not drawn
  };
  enum class StretchKind : std::uint8_t { kCarried, kUnmeasured, kLongLoop };
  struct Stretch {
    StretchKind kind = StretchKind::kCarried;
    double from_m = 0, to_m = 0;
  };
  struct Mark {
    double distance_m = 0;
    std::string text;  // a label
  };

  std::string title, subtitle;
  std::vector<Stop> stops;  // in the order of the way; two or more
  std::vector<Way> ways;    // the first is that of stops, stretches and marks
  std::vector<Stretch> stretches;
  std::vector<Mark> marks;
};

// The places at which the views of a route are shown: at most `count` of its steps, at least two, evenly by distance,
// the first and the last among them. Indices into `steps`, ascending. None if there are no steps.
std::vector<std::size_t> evenly_along(const std::vector<RouteStep>& steps, std::size_t count);

// Where the steps with a property join; touching ones are one stretch.
std::vector<RouteStrip::Stretch> stretches_of(const std::vector<RouteStep>& steps);

// The strip as the bytes of a file; of a PNG, with 1.5 pixels a point. EMPTY_MAP: there are no stops.
Result<std::string> draw_route_strip(const RouteStrip& strip, PictureFormat format);

}  // namespace relmap::client
