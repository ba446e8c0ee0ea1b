#include "tools/relmap/map_shape.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <unordered_map>

#include "client/path_uncertainty.h"
#include "tools/terminal/progress_bar.h"

namespace relmap::cli {

namespace {

using client::Skeleton;

constexpr std::size_t kMaxStrained = 10;

// Divides the step to `point` from the point before it: returns the point that is made of frame `index`, and makes
// `point` the end of what follows it.
Skeleton::Point divide(const Skeleton::Point& before, Skeleton::Point& point, std::uint32_t index) {
  const double share =
      static_cast<double>(index - before.frame.index) / static_cast<double>(point.frame.index - before.frame.index);
  Skeleton::Point made = point;
  made.frame.index = index;
  made.time_us = 0;
  if (before.time_us != 0 && point.time_us != 0)
    made.time_us = before.time_us + std::llround(share * static_cast<double>(point.time_us - before.time_us));
  made.T_before_this = SE3::exp(share * point.T_before_this.log());
  made.translation_variance = share * point.translation_variance;
  made.rotation_variance = share * point.rotation_variance;
  made.frames = std::clamp(static_cast<std::uint32_t>(std::lround(share * point.frames)), 1u, point.frames - 1);
  point.T_before_this = (made.T_before_this.inverse() * point.T_before_this).normalized();
  point.translation_variance -= made.translation_variance;
  point.rotation_variance -= made.rotation_variance;
  point.frames -= made.frames;
  return made;
}

// The strains of edges that the layout was made of and could have stretched.
std::vector<client::Tear> strains_of(const MapShape& shape,
                                     const std::function<bool(const client::Spring&, const client::Tear&)>& wanted) {
  std::vector<client::Tear> strains;
  for (const client::Spring& spring : shape.layout.springs) {
    const SE3* const a = shape.find(spring.relaxed.a);
    const SE3* const b = shape.find(spring.relaxed.b);
    if (spring.doubtful || !a || !b) continue;
    if (const client::Tear strain = client::strain_of(spring, *a, *b); wanted(spring, strain))
      strains.push_back(strain);
  }
  client::sort_worst_first(strains);
  return strains;
}

}  // namespace

std::uint64_t MapShape::closures_in_force() const {
  std::uint64_t count = 0;
  for (const Skeleton::Closure& closure : skeleton.closures)
    if (closure.state == client::EdgeState::kAccepted) count += closure.alike;
  return count;
}

const SE3* MapShape::find(FrameId frame) const {
  const auto found = at.find(frame);
  return found == at.end() ? nullptr : &layout.parts[found->second.part].places[found->second.place].T_root_frame;
}

Result<MapShape> read_map_shape(const ShapeChoice& choice, client::Client& client, terminal::Console& console) {
  const terminal::Console::Aside aside(console);
  MapShape shape;
  auto chosen = read_chosen_sessions(choice.sessions, client, console);
  if (!chosen.ok()) return chosen.status();
  shape.chosen = std::move(chosen).value();
  std::uint64_t keyframes = 0;
  for (const auto& [number, session] : shape.chosen.sessions) keyframes += session.frames;
  if (keyframes == 0) return nothing_to_place(shape.chosen.mono_sessions, "draw", "drawn");
  client::SkeletonOptions options;
  options.level = client::level_for(keyframes);
  options.candidates = true;
  if (!shape.chosen.all) options.sessions = shape.chosen.numbers();
  terminal::ProgressBar bar(console.err(), terminal::is_terminal());
  auto skeleton = client.skeleton(options, [&](const Skeleton& so_far) {
    if (so_far.frames_done < so_far.frames)
      bar.show("reading the map's shape", so_far.frames_done, so_far.frames, "keyframes");
    return Status();
  });
  if (!skeleton.ok()) return skeleton.status();
  shape.skeleton = std::move(skeleton).value();
  if (!choice.removed)
    std::erase_if(shape.skeleton.closures,
                  [](const Skeleton::Closure& closure) { return closure.state == client::EdgeState::kRemoved; });
  add_points(shape.skeleton, choice.points);
  return shape;
}

Status lay_out(MapShape& shape) {
  client::SkeletonLayout options;
  if (shape.skeleton.points() == shape.keyframes()) options.relaxation = {};  // a small map is worth the time
  auto layout = client::relax_skeleton(shape.skeleton, options);
  if (!layout.ok()) return layout.status();
  shape.layout = std::move(layout).value();
  for (std::size_t part = 0; part < shape.layout.parts.size(); ++part)
    for (std::size_t place = 0; place < shape.layout.parts[part].places.size(); ++place)
      shape.at[shape.layout.parts[part].places[place].frame] = {part, place};
  return {};
}

void add_points(Skeleton& skeleton, std::vector<FrameId> frames) {
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  for (Skeleton::Chain& chain : skeleton.chains) {
    const auto begin = std::lower_bound(frames.begin(), frames.end(), chain.points.front().frame);
    const auto end = std::lower_bound(begin, frames.end(), chain.points.back().frame);
    if (begin == end) continue;
    std::vector<Skeleton::Point> points;
    points.reserve(chain.points.size() + static_cast<std::size_t>(end - begin));
    auto wanted = begin;
    for (Skeleton::Point& point : chain.points) {
      for (; wanted != end && *wanted <= point.frame; ++wanted)
        if (*wanted != point.frame && point.frames > 1) points.push_back(divide(points.back(), point, wanted->index));
      points.push_back(point);
    }
    chain.points = std::move(points);
  }
}

std::string shape_text(const MapShape& shape) {
  const std::size_t points = shape.skeleton.points();
  if (points == shape.keyframes()) return {};
  return counted_text(points, "point") + " stand for " + counted_text(shape.keyframes(), "keyframe");
}

std::vector<client::Tear> tears_of(const MapShape& shape) {
  return strains_of(
      shape, [](const client::Spring&, const client::Tear& strain) { return strain.sigmas > client::kTearSigmas; });
}

std::vector<client::Tear> strained_of(const MapShape& shape) {
  std::vector<client::Tear> strained = strains_of(shape, [](const client::Spring& spring, const client::Tear& strain) {
    return spring.kind == client::EdgeKind::kLoop && strain.sigmas > 1;
  });
  if (strained.size() > kMaxStrained) strained.resize(kMaxStrained);
  return strained;
}

std::vector<std::vector<double>> uncertainty_of(const MapShape& shape) {
  std::vector<std::vector<client::RelaxationEdge>> edges(shape.layout.parts.size());
  for (const client::Spring& spring : shape.layout.springs)
    if (const auto at = shape.at.find(spring.relaxed.a); spring.pulls && at != shape.at.end())
      edges[at->second.part].push_back(spring.relaxed);
  std::vector<std::vector<double>> sigmas;
  for (std::size_t p = 0; p < shape.layout.parts.size(); ++p) {
    const client::RelaxedSkeleton::Part& part = shape.layout.parts[p];
    std::vector<FrameId> frames;
    for (const client::RelaxedSkeleton::Place& place : part.places) frames.push_back(place.frame);
    sigmas.push_back(client::position_sigmas(frames, edges[p], part.root));
  }
  return sigmas;
}

std::vector<Weighted> keyframe_sigmas(const MapShape& shape) {
  const std::vector<double> of_points = uncertainty_of(shape).at(0);
  std::vector<Weighted> sigmas;
  for (const Skeleton::Chain& chain : shape.skeleton.chains)
    for (std::size_t i = 0; i < chain.points.size(); ++i) {
      const auto at = shape.at.find(chain.points[i].frame);
      if (at == shape.at.end() || at->second.part != 0 || !std::isfinite(of_points[at->second.place])) continue;
      sigmas.push_back({of_points[at->second.place], i == 0 ? 1 : chain.points[i].frames});
    }
  std::sort(sigmas.begin(), sigmas.end(), [](const Weighted& a, const Weighted& b) { return a.value < b.value; });
  return sigmas;
}

std::map<std::string, std::uint64_t> keyframes_by_day(const Skeleton& skeleton) {
  constexpr std::int64_t kDay = 86'400'000'000;
  std::map<std::int64_t, std::uint64_t> days;
  for (const Skeleton::Chain& chain : skeleton.chains)
    for (std::size_t i = 0; i < chain.points.size(); ++i) {
      const Skeleton::Point& point = chain.points[i];
      const std::int64_t day = point.time_us / kDay;
      const Skeleton::Point& before = chain.points[i > 0 ? i - 1 : 0];
      if (i == 0 || before.time_us == 0 || point.time_us == 0) {
        if (point.time_us != 0) ++days[day];
        continue;
      }
      if (before.time_us / kDay == day) {
        days[day] += point.frames;
        continue;
      }
      for (std::uint32_t k = 1; k <= point.frames; ++k)
        ++days[(before.time_us + (point.time_us - before.time_us) / point.frames * k) / kDay];
    }
  std::map<std::string, std::uint64_t> by_day;
  for (const auto& [day, count] : days) by_day[time_text(day * kDay).substr(0, 10)] += count;
  return by_day;
}

}  // namespace relmap::cli
