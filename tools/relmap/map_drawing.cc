#include "tools/relmap/map_drawing.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "client/skeleton_picture.h"

namespace relmap::cli {

namespace {

using client::MapPicture;
using client::Skeleton;

// The picture shows points of a skeleton; what they stand for is counted.
void count_keyframes(const MapShape& shape, MapPicture& picture) {
  for (MapPicture::Part& part : picture.parts) part.keyframes = 0;
  for (const Skeleton::Chain& chain : shape.skeleton.chains)
    for (std::size_t i = 0; i < chain.points.size(); ++i) {
      const std::size_t frames = i == 0 ? 1 : chain.points[i].frames;
      picture.session_keyframes[chain.session] += frames;
      picture.parts[shape.at.at(chain.points[i].frame).part].keyframes += frames;
    }
  using State = client::EdgeState;
  constexpr std::pair<State, MapPicture::EdgeKind> kKinds[] = {
      {State::kAccepted, MapPicture::EdgeKind::kLoopAccepted},
      {State::kCandidate, MapPicture::EdgeKind::kLoopCandidate},
      {State::kQuarantined, MapPicture::EdgeKind::kLoopQuarantined},
      {State::kRemoved, MapPicture::EdgeKind::kLoopRemoved}};
  for (const Skeleton::Closure& closure : shape.skeleton.closures) {
    const auto a = shape.at.find(closure.a), b = shape.at.find(closure.id.frame);
    if (a == shape.at.end() || b == shape.at.end() || a->second.part != b->second.part) continue;  // not drawn
    for (const auto& [state, kind] : kKinds)
      if (closure.state == state) picture.alike[kind] += closure.alike - 1;
  }
}

// Between the chains of a session lies motion of which nothing is known, so that the skeleton does not have it.
void add_unknown_motion(const Skeleton& skeleton, MapPicture& picture) {
  for (std::size_t i = 1; i < skeleton.chains.size(); ++i) {
    const Skeleton::Chain& before = skeleton.chains[i - 1];
    const Skeleton::Chain& after = skeleton.chains[i];
    if (before.session == after.session)
      picture.edges.push_back(
          {before.points.back().frame, after.points.front().frame, MapPicture::EdgeKind::kUnmeasuredMotion});
  }
}

}  // namespace

MapPicture picture_of(const MapShape& shape, const std::vector<client::LabelledFrames>& labels) {
  MapPicture picture;
  for (const auto& [number, session] : shape.chosen.sessions) picture.session_names[number] = session.name;
  client::add_skeleton(picture, shape.skeleton, shape.layout);
  add_unknown_motion(shape.skeleton, picture);
  count_keyframes(shape, picture);
  for (const client::LabelledFrames& label : labels)
    for (const FrameId frame : label.frames)
      if (shape.at.contains(frame)) picture.labels.push_back({frame, label.label});
  picture.subtitle = counted_text(shape.chosen.sessions.size(), "session") + ", " +
                     counted_text(shape.keyframes(), "keyframe") + ", " +
                     counted_text(shape.closures_in_force(), "loop closure");
  picture.mono_sessions = shape.chosen.mono_sessions;
  return picture;
}

void mark_tears(const std::vector<client::Tear>& tears, const std::vector<client::Tear>& strained,
                MapPicture& picture) {
  for (const client::Tear& tear : tears) picture.tears.push_back({tear.a, tear.b, tear.sigmas});
  for (const client::Tear& strain : strained)
    picture.strained.push_back(strain.name() + ": " + fixed(strain.sigmas, 1) + " sigmas, " + fixed(strain.metres, 2) +
                               " m");
}

void colour_by_time(const MapShape& shape, MapPicture& picture) {
  std::int64_t first = std::numeric_limits<std::int64_t>::max(), last = 0;
  for (const Skeleton::Chain& chain : shape.skeleton.chains)
    for (const Skeleton::Point& point : chain.points) {
      if (point.time_us == 0) continue;  // not known
      first = std::min(first, point.time_us);
      last = std::max(last, point.time_us);
    }
  const bool any = last > 0;
  picture.scale = {"colour: when it was driven", any ? time_text(first) : "", any ? time_text(last) : ""};
  for (const Skeleton::Chain& chain : shape.skeleton.chains)
    for (const Skeleton::Point& point : chain.points) {
      if (point.time_us == 0) continue;
      const MapShape::At at = shape.at.at(point.frame);
      picture.parts[at.part].frames[at.place].value =
          last > first ? static_cast<double>(point.time_us - first) / static_cast<double>(last - first) : 0;
    }
}

void colour_by_uncertainty(const MapShape& shape, MapPicture& picture) {
  const std::vector<std::vector<double>> sigmas = uncertainty_of(shape);
  double highest = 0;
  for (const std::vector<double>& part : sigmas)
    for (const double sigma : part)
      if (std::isfinite(sigma)) highest = std::max(highest, sigma);
  picture.scale = {
      "colour: uncertainty of the position relative to " +
          (sigmas.size() == 1 ? shape.layout.parts[0].root.to_string() : std::string("the root of each part")),
      "0 m", number_text(highest) + " m (one sigma)"};
  for (std::size_t p = 0; p < picture.parts.size(); ++p)
    for (std::size_t f = 0; f < picture.parts[p].frames.size(); ++f)
      picture.parts[p].frames[f].value = highest > 0 ? sigmas[p][f] / highest : sigmas[p][f];
}

std::vector<FrameId> corners_of(const std::vector<FrameId>& route) {
  std::vector<FrameId> corners;
  for (std::size_t i = 0; i < route.size(); ++i) {
    const auto follows = [&](std::size_t k) {  // along the motion of a session
      return k > 0 && k < route.size() && route[k].session == route[k - 1].session &&
             (route[k].index == route[k - 1].index + 1 || route[k].index + 1 == route[k - 1].index);
    };
    if (!follows(i) || !follows(i + 1)) corners.push_back(route[i]);
  }
  return corners;
}

std::vector<FrameId> drawn_of(const MapShape& shape, const std::vector<FrameId>& route) {
  std::vector<FrameId> drawn;
  for (const FrameId frame : route)
    if (shape.find(frame) || !shape.chosen.sessions.contains(frame.session)) drawn.push_back(frame);
  return drawn;
}

}  // namespace relmap::cli
