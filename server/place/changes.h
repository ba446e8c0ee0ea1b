// Does a picture show the place that it is taken for? Of two floors that look alike most is the same and something is
// not: there old landmarks are not found by what they looked like, and all of them together, while elsewhere in the
// picture most are (docs/method.md, 7).
#pragma once

#include <cstdint>
#include <span>

#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::place {

// An old landmark that should be in the picture, seen from about as near as before.
struct SoughtLandmark {
  Vector2 expected;    // pixels
  bool found = false;  // by what it looked like (server/place/reobserve.h)
};

struct Changes {
  std::uint16_t compared = 0;  // cells of the picture in which so many are sought that one would be found
  std::uint16_t changed = 0;   // of them, those in which none is

  bool operator==(const Changes&) const = default;
};

// How much is found of what is there depends on light, blur and camera. So it is taken from the picture itself: the
// share that is found in cells where anything is. A cell is compared where by that share some would be found with 99 %;
// nothing is where fewer than eight cells are.
Changes changes(std::span<const SoughtLandmark> sought, const StereoCamera& camera);

// Whether a picture is of the one place rather than of the other, which changed in significantly more cells (a sign
// test at about 6 %).
inline bool told_apart(const Changes& place, const Changes& other) {
  return place.compared > 0 && other.changed >= 4 + 3 * place.changed;
}

}  // namespace relmap::place
