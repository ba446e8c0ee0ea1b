// 9 x 9 patches: compared by the sum of absolute differences after a shift to the same mean, and aligned to a fraction
// of a pixel.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "frontend/vision/image.h"

namespace relmap {

inline constexpr int kPatchSide = 9;
inline constexpr int kPatchRadius = 4;
inline constexpr int kPatchPixels = kPatchSide * kPatchSide;

// True if the whole patch centred there lies in the picture, with `margin` pixels to spare.
inline bool patch_fits(ImageView image, int x, int y, int margin = 0) {
  const int r = kPatchRadius + margin;
  return x >= r && y >= r && x < image.width - r && y < image.height - r;
}

// A patch made ready to be compared with many. `compare` gives the sum over the 81 pixels of |a + shift - b|, `shift`
// the rounded difference of means, a + shift cut to 0..255.
class SadPatch {
 public:
  SadPatch(ImageView image, int x, int y);  // the patch must fit
  explicit SadPatch(const std::array<std::uint8_t, kPatchPixels>& pixels);
  int compare(ImageView image, int x, int y) const;  // the patch must fit

 private:
  void finish();
  alignas(16) std::uint8_t rows_[kPatchSide][16] = {};
  int sum_ = 0;
};

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
  using Surroundings = std::array<float, 11 * 11>;
  bool prepare(const Surroundings& surroundings);
  std::array<float, kPatchPixels> pixels_{}, gx_{}, gy_{};  // pixels_ less their mean
  float mean_ = 0, energy_ = 0;
};

// Bilinear; (x, y) and its neighbours to the right and below must lie in the picture.
inline float sample(ImageView image, float x, float y) {
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const std::uint8_t *above = image.row(y0) + x0, *below = image.row(y0 + 1) + x0;
  return (1 - fy) * ((1 - fx) * above[0] + fx * above[1]) + fy * ((1 - fx) * below[0] + fx * below[1]);
}

}  // namespace relmap
