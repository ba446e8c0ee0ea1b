// Colours for values between 0 and 1, in which equal steps look equally large, to people who lack red, green or blue
// cones, too: the lightness rises all along. They are the polynomials of degree 6 nearest to the scales "viridis" and
// "plasma" of van der Walt and Smith.
#pragma once

#include "client/drawing.h"

namespace relmap::client {

// From dark violet by green to yellow.
Colour viridis(double t);
// From blue by red to yellow.
Colour plasma(double t);

// For marks on white paper, where the largest value must be the darkest: from yellowish green to dark violet.
Colour paper_scale(double t);
// For marks on grey pictures, where all must be bright: from violet to yellow.
Colour picture_scale(double t);

}  // namespace relmap::client
