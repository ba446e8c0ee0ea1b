// Tells whether a picture shows the place that it is taken for, by what is missing in the cells of the picture. Two
// floors that look alike are the same in most parts of the picture and differ in some: in those, no old landmark is
// found by its appearance, while elsewhere in the picture most are found (docs/method.md, 7).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"
#include "server/place/verify.h"

namespace relmap::place {

// The cells by which views of a place are compared.
inline constexpr int kPictureColumns = 8, kPictureRows = 6;
inline constexpr std::size_t kPictureCells = kPictureColumns * kPictureRows;

// The ratio of viewing distances beyond which a point may look different.
inline constexpr double kMaxNearer = 1.5;

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

// Measures by features alone how much two views differ that geometry takes for one place. Returns the share (0..1) of
// cells of the query's picture that differ from the map. A cell is compared if the query has at least three features in
// it and the map expects at least three points there that were seen from about the same distance. A compared cell
// differs if none of these points is found again. Returns -1 if fewer than eight cells can be compared, the pose is not
// metric or the focal length is unknown.
float differing_share(const storage::Graph& graph, const QueryPicture& query, const VerifiedPlace& place);

}  // namespace relmap::place
