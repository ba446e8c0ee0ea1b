// 9 x 9 patches, compared by the sum of absolute differences (SAD) after shifting one of them to the other's mean.
#pragma once

#include <array>
#include <cstdint>

#include "frontend/vision/image.h"

namespace relmap::vision {

inline constexpr int kPatchSide = 9;
inline constexpr int kPatchRadius = 4;
inline constexpr int kPatchPixels = kPatchSide * kPatchSide;

// True if the whole patch centred there lies in the picture, with `margin` pixels to spare.
inline bool patch_fits(ImageView image, int x, int y, int margin = 0) {
  const int r = kPatchRadius + margin;
  return x >= r && y >= r && x < image.width - r && y < image.height - r;
}

// A patch a, prepared for comparison with many. compare() returns the sum over the 81 pixels of |a + shift - b|, where
// `shift` is the rounded difference of the means, and a + shift is clamped to 0..255.
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

}  // namespace relmap::vision
