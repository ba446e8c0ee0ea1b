// The colours of pictures of the map. On white, any two of them can be told apart by everyone, including people who
// lack red, green or blue cones (map_colours_test).
#pragma once

#include <array>
#include <cstddef>

#include "client/drawing.h"

namespace relmap::client {

// The colours of sessions, in the order in which they are drawn. They repeat after the last one.
inline constexpr std::array<Colour, 6> kSessionColours{Colour{0, 114, 178},  Colour{31, 187, 75}, Colour{188, 150, 207},
                                                       Colour{76, 161, 255}, Colour{126, 46, 19}, Colour{96, 3, 113}};
inline constexpr Colour session_colour(std::size_t place) { return kSessionColours[place % kSessionColours.size()]; }

inline constexpr Colour kLoopColour{213, 94, 0};           // closures in force
inline constexpr Colour kNotInForceColour{146, 148, 154};  // other closures
inline constexpr Colour kRouteColour{246, 190, 40};
inline constexpr Colour kQueryColour{228, 12, 107};
inline constexpr Colour kInkColour{38, 42, 48};  // texts, labels

// These are no marks, and need not be told apart from those above.
inline constexpr Colour kWhiteColour{255, 255, 255};  // panels, and what lies between marks
inline constexpr Colour kFaintColour{112, 118, 126};  // small texts

}  // namespace relmap::client
