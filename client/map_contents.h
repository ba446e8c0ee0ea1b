// Looks up what a picture of the map shows, by frame, session and kind of edge.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "client/drawing.h"
#include "client/map_picture.h"

namespace relmap::client {

class MapContents {
 public:
  explicit MapContents(const MapPicture& picture);  // `picture` must outlive it

  const MapPicture& picture() const { return picture_; }

  struct Place {
    std::size_t part = 0;
    const SE3* T_root_frame = nullptr;
    double value = 0;  // MapPicture::Frame::value
  };
  // Null: the frame is not in the picture.
  const Place* find(FrameId frame) const;

  // The frames of each session, ascending, over all parts.
  const std::map<SessionNumber, std::vector<FrameId>>& sessions() const { return sessions_; }
  // Whether the sessions of a part are labelled, and their ends marked. The marks of hundreds would hide what they
  // drove.
  bool marks_sessions(std::size_t part) const { return sessions_in_part_[part] <= kMarkedSessions; }
  // How many keyframes of the session the picture shows, or stands for.
  std::size_t keyframes(SessionNumber session) const;
  // The name of a session, with its number if there are more sessions than colours.
  std::string name(SessionNumber session) const;
  // Grey, if frames are coloured by their values.
  Colour colour(SessionNumber session) const;
  // The colour of a frame: that of its value, if there is a scale; else that of its session, or, if there is only one
  // session, a shade from light to dark in time.
  Colour shade(FrameId frame) const;

  // The edge of the robot's motion that leads to this frame from an older one in the same part; null: there is none.
  const MapPicture::Edge* step(FrameId frame) const;
  // The number of edges of this kind within parts, and of those between parts, which are not drawn.
  std::size_t count(MapPicture::EdgeKind kind) const;
  std::size_t count_between_parts(MapPicture::EdgeKind kind) const;

 private:
  static constexpr std::size_t kMarkedSessions = 40;

  const MapPicture& picture_;
  std::unordered_map<FrameId, Place> places_;
  std::map<SessionNumber, std::vector<FrameId>> sessions_;
  std::vector<std::size_t> sessions_in_part_;
  std::unordered_map<FrameId, const MapPicture::Edge*> steps_;
  std::map<MapPicture::EdgeKind, std::size_t> within_, between_;
};

}  // namespace relmap::client
