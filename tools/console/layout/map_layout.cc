#include "tools/console/layout/map_layout.h"

#include <algorithm>
#include <cmath>

namespace relmap::console {
namespace {

Matrix3 matrix_of(const std::array<float, 3>& rotation) { return so3_exp({rotation[0], rotation[1], rotation[2]}); }

}  // namespace

double MapLayout::Place::heading() const { return std::atan2(rotation(1, 2), rotation(0, 2)); }
double MapLayout::Place::x_axis() const { return std::atan2(rotation(1, 0), rotation(0, 0)); }

const MapLayout::Run* MapLayout::run_of(FrameId frame) const {
  const auto after = std::upper_bound(runs.begin(), runs.end(), frame,
                                      [&](FrameId id, const Run& run) { return id < frame_of(run, run.first); });
  if (after == runs.begin()) return nullptr;
  const Run& run = *std::prev(after);
  return run.session == frame.session && frame.index <= points[run.end - 1].index ? &run : nullptr;
}

std::optional<MapLayout::Place> MapLayout::place(FrameId frame) const {
  const Run* const run = run_of(frame);
  if (!run) return {};
  const auto at = std::lower_bound(points.begin() + run->first, points.begin() + run->end, frame.index,
                                   [](const Point& point, std::uint32_t index) { return point.index < index; });
  Place place;
  place.run = static_cast<std::uint32_t>(run - runs.data());
  place.point = static_cast<std::uint32_t>(at - points.begin());
  place.position = at->position;
  place.rotation = matrix_of(at->rotation);
  if (at->index == frame.index) return place;
  const Point& before = *std::prev(at);
  const double share = static_cast<double>(frame.index - before.index) / static_cast<double>(at->index - before.index);
  const Matrix3 from = matrix_of(before.rotation);
  place.position = before.position + share * (at->position - before.position);
  place.rotation = from * so3_exp(share * so3_log(from.transpose() * place.rotation));
  return place;
}

Matrix3 MapLayout::rotation_of(std::uint32_t point) const { return matrix_of(points[point].rotation); }

std::size_t MapLayout::bytes() const {
  std::size_t all = sizeof *this + points.capacity() * sizeof(Point) + runs.capacity() * sizeof(Run) +
                    closures.capacity() * sizeof(Closure) + torn.capacity() * sizeof(client::Tear);
  for (const Part& part : parts) all += sizeof part + part.sessions.capacity() * sizeof(SessionNumber);
  return all;
}

}  // namespace relmap::console
