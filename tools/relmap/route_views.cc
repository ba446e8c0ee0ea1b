#include "tools/relmap/route_views.h"

#include <cmath>
#include <vector>

#include "client/route_strip.h"
#include "tools/relmap/edge_words.h"
#include "tools/relmap/picture_output.h"

namespace relmap::cli {

namespace {

using client::RouteStrip;

RouteStrip::Way way_of(const client::Route& route, const std::string& which) {
  RouteStrip::Way way;
  way.name = fixed(route.distance_m, 1) + " m, " + terminal::duration_text(route.time_s) + which;
  for (const client::RouteStep& step : route.steps)
    way.points.push_back({step.distance_m, std::sqrt(std::max(0.0, step.covariance.diagonal().head<3>().sum()))});
  if (!way.points.empty())
    way.name += "; its end is known to " + number_text(way.points.back().sigma_m) + " m (one sigma)";
  return way;
}

RouteStrip strip_of(const client::Route& route, std::size_t stops, client::Client& client) {
  RouteStrip strip;
  strip.title = "From " + route.from.to_string() + " to " + route.to.to_string();
  strip.subtitle = fixed(route.distance_m, 1) + " m, " + terminal::duration_text(route.time_s) + ", " +
                   counted_text(route.steps.size(), "keyframe");
  for (const std::string& text : {unmeasured_text(route.unmeasured, route.distance_m), carried_text(route.carried)})
    if (!text.empty()) strip.subtitle += "; " + text;
  for (const std::size_t at : client::evenly_along(route.steps, stops)) {
    const client::RouteStep& step = route.steps[at];
    RouteStrip::Stop& stop = strip.stops.emplace_back();
    stop.frame = step.frame;
    stop.distance_m = step.distance_m;
    stop.time_s = step.time_s;
    if (!step.labels.empty()) stop.label = step.labels.front();
    if (auto frame = client.frame(step.frame, /*with_thumbnail=*/true); frame.ok()) stop.picture = frame->thumbnail;
  }
  strip.ways.push_back(way_of(route, route.alternatives.empty() ? "" : ", the cheapest"));
  for (const client::Route& other : route.alternatives)
    strip.ways.push_back(way_of(other, ", alternative " + std::to_string(strip.ways.size()) + ", " +
                                           fixed(100 * other.shared, 0) + " % of it shared with those before it"));
  strip.stretches = client::stretches_of(route.steps);
  for (const client::RouteStep& step : route.steps)
    for (const std::string& label : step.labels) strip.marks.push_back({step.distance_m, label});
  return strip;
}

}  // namespace

Status write_route_strip(const client::Route& route, std::size_t stops, const std::string& out, client::Client& client,
                         terminal::Console& console) {
  const auto format = client::picture_format(out);
  if (!format.ok()) return format.status();
  const terminal::Console::Aside aside(console);
  const auto bytes = client::draw_route_strip(strip_of(route, stops, client), *format);
  return bytes.ok() ? write_output(out, *bytes, console) : bytes.status();
}

}  // namespace relmap::cli
