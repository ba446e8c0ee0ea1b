// Shows a drive of relmap-sim through a simulated camera of the same picture size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "frontend/vision/image.h"
#include "tests/camera/simulated_camera.h"

namespace relmap::testing {

// Must outlive the cameras that show it.
class ShownDrive {
 public:
  // Reads all pictures in image_0 and image_1 of `folder` into memory. Throws.
  explicit ShownDrive(const std::string& folder);
  ShownDrive(const ShownDrive&) = delete;
  ShownDrive& operator=(const ShownDrive&) = delete;

  std::size_t pairs() const { return left_.size(); }

  // Each frame shows the next pair; after the end, the last pair.
  SimulatedCameraOptions camera(double rate) const;
  // The same, but shows the drive back and forth for ever, so that a program that starts late on a busy machine sees
  // motion, too.
  SimulatedCameraOptions shuttling_camera(double rate) const;

 private:
  void interleave(std::size_t pair, std::span<std::uint8_t> interleaved) const;

  std::vector<vision::Image> left_, right_;
};

}  // namespace relmap::testing
