// The shape of the map as a picture (client/map_picture.h).
#pragma once

#include "client/map_picture.h"
#include "tools/relmap/map_shape.h"

namespace relmap::cli {

// All parts with their closures and labels, coloured by session. The shape must be laid out.
client::MapPicture picture_of(const MapShape& shape, const std::vector<client::LabelledFrames>& labels);

// Marks tears, and lists the closures that are stretched most; both as of map_shape.h.
void mark_tears(const std::vector<client::Tear>& tears, const std::vector<client::Tear>& strained,
                client::MapPicture& picture);
// When each point was taken.
void colour_by_time(const MapShape& shape, client::MapPicture& picture);
// How well the position of each point relative to the root of its part is known.
void colour_by_uncertainty(const MapShape& shape, client::MapPicture& picture);

// What of a route has to be a point of the shape for its line to be drawn where it leads: its ends, and the ends of the
// closures that it takes.
std::vector<FrameId> corners_of(const std::vector<FrameId>& route);
// The frames of a route by which its line is drawn: without those between two points of the shape. Frames of sessions
// that are not drawn stay, and interrupt the line.
std::vector<FrameId> drawn_of(const MapShape& shape, const std::vector<FrameId>& route);

}  // namespace relmap::cli
