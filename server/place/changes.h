// Tells whether a picture shows the place that it is taken for. Two floors that look alike are the same in most parts
// of the picture and differ in some: in those, no old landmark is found by its appearance, while elsewhere in the
// picture most are found (docs/method.md, 7).
#pragma once

#include <cstdint>
#include <span>

#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::place {

// An old landmark that should be in the picture at about the distance from which it was seen before.
struct SoughtLandmark {
  Vector2 expected;    // pixels
  bool found = false;  // by its appearance (server/place/reobserve.h)
};

struct Changes {
  std::uint16_t compared = 0;  // cells of the picture with enough landmarks that at least one should be found
  std::uint16_t changed = 0;   // compared cells in which none is found

  bool operator==(const Changes&) const = default;
};

// Compares the cells of a picture. The share of visible landmarks that are found depends on light, blur and camera, so
// it is estimated from the picture itself: from the cells in which any landmark is found. A cell is compared if at
// that share at least one of its landmarks would be found with a probability of 99 %. If fewer than eight cells can be
// compared, the result is all zeros.
Changes changes(std::span<const SoughtLandmark> sought, const StereoCamera& camera);

// Whether a picture shows `place` rather than `other`, because `other` has changed in significantly more cells (a sign
// test at about 6 %).
inline bool told_apart(const Changes& place, const Changes& other) {
  return place.compared > 0 && other.changed >= 4 + 3 * place.changed;
}

}  // namespace relmap::place
