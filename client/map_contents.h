// What a picture of the map shows, looked up by frame, session and kind.
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
  explicit MapContents(const MapPicture& picture);  // which must outlive it

  const MapPicture& picture() const { return picture_; }

  struct Place {
    std::size_t part = 0;
    const SE3* T_root_frame = nullptr;
  };
  // Null: the frame is not in the picture.
  const Place* find(FrameId frame) const;

  // Frames of each session, ascending, in whatever parts.
  const std::map<SessionNumber, std::vector<FrameId>>& sessions() const { return sessions_; }
  // Of a session: its name, with its number where colours come again.
  std::string name(SessionNumber session) const;
  // Colour of a session, and of one of its frames: of a single session the course of time is shown, light to dark.
  Colour colour(SessionNumber session) const;
  Colour shade(FrameId frame) const;

  // The edge of its robot's motion that leads to this frame from an older one of its part; null: there is none.
  const MapPicture::Edge* step(FrameId frame) const;
  // Edges of the kind within parts, and those that lead from one part to another, which are not drawn.
  std::size_t count(MapPicture::EdgeKind kind) const;
  std::size_t count_between_parts(MapPicture::EdgeKind kind) const;

 private:
  const MapPicture& picture_;
  std::unordered_map<FrameId, Place> places_;
  std::map<SessionNumber, std::vector<FrameId>> sessions_;
  std::unordered_map<FrameId, const MapPicture::Edge*> steps_;
  std::map<MapPicture::EdgeKind, std::size_t> within_, between_;
};

}  // namespace relmap::client
