#include "tests/camera/shown_drive.h"

#include <algorithm>
#include <filesystem>

#include "frontend/capture/picture_file.h"

namespace relmap::testing {

ShownDrive::ShownDrive(const std::string& folder) {
  const auto read = [&](const std::string& eye) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder + "/" + eye)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<vision::Image> pictures;
    for (const auto& file : files) pictures.push_back(capture::read_picture(file).or_throw());
    return pictures;
  };
  left_ = read("image_0");
  right_ = read("image_1");
}

SimulatedCameraOptions ShownDrive::camera(double rate) const {
  SimulatedCameraOptions options;
  options.width = left_.front().width();
  options.height = left_.front().height();
  options.rate = rate;
  options.content = [this](std::uint64_t number, std::span<std::uint8_t> interleaved) {
    interleave(std::min<std::size_t>(number, pairs() - 1), interleaved);
  };
  return options;
}

SimulatedCameraOptions ShownDrive::shuttling_camera(double rate) const {
  SimulatedCameraOptions options = camera(rate);
  options.content = [this](std::uint64_t number, std::span<std::uint8_t> interleaved) {
    const std::size_t last = pairs() - 1, step = number % (2 * last);
    interleave(step <= last ? step : 2 * last - step, interleaved);
  };
  return options;
}

void ShownDrive::interleave(std::size_t pair, std::span<std::uint8_t> interleaved) const {
  const std::uint8_t *left = left_[pair].row(0), *right = right_[pair].row(0);
  for (std::size_t i = 0; i + 1 < interleaved.size(); i += 2, ++left, ++right)
    interleaved[i] = *right, interleaved[i + 1] = *left;
}

}  // namespace relmap::testing
