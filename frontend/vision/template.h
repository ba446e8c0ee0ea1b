// Aligns patches to a fraction of a pixel.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "frontend/vision/image.h"
#include "frontend/vision/patch.h"

namespace relmap::vision {

// The surroundings of a point when it was first seen, large enough to cut out a 9 x 9 patch that is rotated and scaled
// by up to 1.5.
struct Anchor {
  static constexpr int kSide = 19;
  static constexpr int kRadius = 9;
  std::array<std::uint8_t, kSide * kSide> pixels{};
  float x = 0, y = 0;  // position of the point relative to the centre of the middle pixel, -0.5..0.5

  // Nothing if the surroundings reach beyond the picture.
  static std::optional<Anchor> take(ImageView image, float x, float y);
};

// Maps offsets from the point in the current picture to offsets in the anchor: anchor = [a b; c d] * current.
struct Warp {
  float a = 1, b = 0, c = 0, d = 1;
};

// A 9 x 9 template with its gradients. It is aligned by translation, brightness and contrast, by efficient second-order
// minimisation (ESM; Malis, ICRA 2004), whose Jacobian is the mean of the template's and the picture's gradients.
class Template {
 public:
  // Nothing if the warp reaches beyond the anchor, or the patch lacks texture in one direction.
  static std::optional<Template> from_anchor(const Anchor& anchor, const Warp& warp = {});
  static std::optional<Template> from_image(ImageView image, float x, float y);

  // The template's pixels, rounded, for a search before the alignment.
  SadPatch sad() const;

  struct Alignment {
    float x = 0, y = 0;
    float error = 0;        // mean absolute difference after the shift of means, grey levels
    float correlation = 0;  // normalised, -1..1
  };
  // Starts at (x, y). Nothing if it leaves the picture, moves further than `reach` pixels, or does not converge.
  std::optional<Alignment> align(ImageView image, float x, float y, float reach = 2.5F) const;

 private:
  Template() = default;
  // Rows of 12, so that they fill whole vectors: nine pixels and three zeros. `Surroundings` has a border of one pixel.
  static constexpr int kRow = 12;
  using Rows = std::array<float, kPatchSide * kRow>;
  using Surroundings = std::array<float, (kPatchSide + 2) * kRow + 4>;
  static void sample_block(ImageView image, float left, float top, Surroundings& out);
  bool prepare(const Surroundings& surroundings);
  Rows pixels_{}, gx_{}, gy_{};  // pixels_ has its mean subtracted
  float mean_ = 0, energy_ = 0;
};

}  // namespace relmap::vision
