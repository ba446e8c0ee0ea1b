#include "client/map_contents.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "client/colour_scale.h"
#include "client/map_colours.h"

namespace relmap::client {

MapContents::MapContents(const MapPicture& picture) : picture_(picture) {
  for (std::size_t part = 0; part < picture.parts.size(); ++part) {
    std::set<SessionNumber> in_part;
    for (const MapPicture::Frame& frame : picture.parts[part].frames) {
      places_[frame.id] = {part, &frame.T_root_frame, frame.value};
      sessions_[frame.id.session].push_back(frame.id);
      in_part.insert(frame.id.session);
    }
    sessions_in_part_.push_back(in_part.size());
  }
  for (auto& [session, frames] : sessions_) std::sort(frames.begin(), frames.end());
  for (const MapPicture::Edge& edge : picture.edges) {
    const Place* const a = find(edge.a);
    const Place* const b = find(edge.b);
    if (!a || !b) continue;
    if (a->part != b->part) {
      ++between_[edge.kind];
      continue;
    }
    ++within_[edge.kind];
    if (is_motion(edge.kind)) steps_.emplace(std::max(edge.a, edge.b), &edge);
  }
}

const MapContents::Place* MapContents::find(FrameId frame) const {
  const auto found = places_.find(frame);
  return found == places_.end() ? nullptr : &found->second;
}

std::size_t MapContents::keyframes(SessionNumber session) const {
  const auto told = picture_.session_keyframes.find(session);
  return told == picture_.session_keyframes.end() ? sessions_.at(session).size() : told->second;
}

std::string MapContents::name(SessionNumber session) const {
  const auto named = picture_.session_names.find(session);
  const std::string number = std::to_string(session);
  if (named == picture_.session_names.end()) return "session " + number;
  return sessions_.size() > kSessionColours.size() ? number + " " + named->second : named->second;
}

Colour MapContents::colour(SessionNumber session) const {
  if (picture_.scale) return kFaintColour;
  return session_colour(static_cast<std::size_t>(std::distance(sessions_.begin(), sessions_.find(session))));
}

Colour MapContents::shade(FrameId frame) const {
  if (picture_.scale) {
    const Place* const place = find(frame);
    return place && std::isfinite(place->value) ? paper_scale(place->value) : kNotInForceColour;
  }
  const Colour full = colour(frame.session);
  const std::vector<FrameId>& frames = sessions_.at(frame.session);
  if (sessions_.size() > 1 || frames.size() < 2) return full;
  const auto place = std::distance(frames.begin(), std::lower_bound(frames.begin(), frames.end(), frame));
  return mix(mix(full, kWhiteColour, 0.5), full, static_cast<double>(place) / static_cast<double>(frames.size() - 1));
}

const MapPicture::Edge* MapContents::step(FrameId frame) const {
  const auto found = steps_.find(frame);
  return found == steps_.end() ? nullptr : found->second;
}

std::size_t MapContents::count(MapPicture::EdgeKind kind) const {
  const auto found = within_.find(kind);
  return found == within_.end() ? 0 : found->second;
}

std::size_t MapContents::count_between_parts(MapPicture::EdgeKind kind) const {
  const auto found = between_.find(kind);
  return found == between_.end() ? 0 : found->second;
}

}  // namespace relmap::client
