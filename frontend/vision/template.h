// Patches aligned to a fraction of a pixel.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "frontend/vision/image.h"
#include "frontend/vision/patch.h"

namespace relmap::vision {

// The surroundings of a point as they looked when it was anchored: enough to cut a 9 x 9 patch turned and scaled by up
// to 1.5 out of it.
struct Anchor {
  static constexpr int kSide = 19;
  static constexpr int kRadius = 9;
  std::array<std::uint8_t, kSide * kSide> pixels{};
  float x = 0, y = 0;  // of the point, from the centre of the middle pixel; within -0.5..0.5

  // Nothing if the surroundings leave the picture.
  static std::optional<Anchor> take(ImageView image, float x, float y);
};

// Where a pixel of the current picture, relative to the point, lies in the anchor: anchor = m * current.
struct Warp {
  float a = 1, b = 0, c = 0, d = 1;  // [a b; c d]
};

// A 9 x 9 template with its gradients, to be aligned by translation, brightness and contrast: efficient second-order
// minimisation (ESM; Malis, ICRA 2004), whose Jacobian is the mean of the template's gradients and the picture's.
class Template {
 public:
  // Nothing if the warp reaches out of the anchor or the patch has no texture to align in both directions.
  static std::optional<Template> from_anchor(const Anchor& anchor, const Warp& warp = {});
  static std::optional<Template> from_image(ImageView image, float x, float y);

  // The template's pixels rounded, for the search before the alignment.
  SadPatch sad() const;

  struct Alignment {
    float x = 0, y = 0;
    float error = 0;        // mean absolute difference, grey levels, after the shift of means
    float correlation = 0;  // normalised, -1..1
  };
  // Starts at (x, y); nothing if it leaves the picture, strays further than `reach` pixels or does not settle.
  std::optional<Alignment> align(ImageView image, float x, float y, float reach = 2.5F) const;

 private:
  Template() = default;
  // Rows of 12, so that they are whole vectors: nine pixels and three zeros; and the patch with a pixel all round.
  static constexpr int kRow = 12;
  using Rows = std::array<float, kPatchSide * kRow>;
  using Surroundings = std::array<float, (kPatchSide + 2) * kRow + 4>;
  static void sample_block(ImageView image, float left, float top, Surroundings& out);
  bool prepare(const Surroundings& surroundings);
  Rows pixels_{}, gx_{}, gy_{};  // pixels_ less their mean
  float mean_ = 0, energy_ = 0;
};

}  // namespace relmap::vision
