// A drive of relmap-sim as a camera of its size shows it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "frontend/vision/image.h"
#include "tests/camera/simulated_camera.h"

namespace relmap::testing {

// Outlives the cameras that it is shown by.
class ShownDrive {
 public:
  // The pictures in image_0 and image_1 of `folder`, all in memory. Throws.
  explicit ShownDrive(const std::string& folder);
  ShownDrive(const ShownDrive&) = delete;
  ShownDrive& operator=(const ShownDrive&) = delete;

  std::size_t pairs() const { return left_.size(); }

  // A pair a frame, and the last one from then on.
  SimulatedCameraOptions camera(double rate) const;
  // The same, forth and back for ever: a program that comes late on a busy machine sees the eyes move, too.
  SimulatedCameraOptions shuttling_camera(double rate) const;

 private:
  void interleave(std::size_t pair, std::span<std::uint8_t> interleaved) const;

  std::vector<vision::Image> left_, right_;
};

}  // namespace relmap::testing
