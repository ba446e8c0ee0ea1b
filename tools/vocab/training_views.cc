#include "tools/vocab/training_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

namespace relmap::vocab {
namespace {

constexpr double kViewsPerArea = 2.5;  // more than 1: views overlap like those of a moving camera
constexpr double kSlant = 0.12;        // a corner is moved by at most this share of a side

// Uniform in [0, 1), the same with every standard library.
class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : random_(seed) {}
  double operator()() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double between(double low, double high) { return low + (high - low) * (*this)(); }

 private:
  std::mt19937_64 random_;
};

vision::Image to_image(const cv::Mat& grey) {
  vision::Image image(grey.cols, grey.rows);
  for (int y = 0; y < grey.rows; ++y) std::copy_n(grey.ptr<std::uint8_t>(y), grey.cols, image.row(y));
  return image;
}

// The view of a camera that looks at a part of the picture, at a scale between the camera's own size and the whole.
cv::Mat look(const cv::Mat& picture, Uniform& uniform) {
  const double largest = std::min(double{1} * picture.cols / kViewWidth, double{1} * picture.rows / kViewHeight);
  const double scale = std::exp(uniform.between(0, std::log(largest)));
  const double width = scale * kViewWidth, height = scale * kViewHeight;
  const double left = uniform.between(0, picture.cols - width), top = uniform.between(0, picture.rows - height);
  // Reduced before it is warped, so that nothing aliases.
  cv::Mat part = picture(
      cv::Rect(static_cast<int>(left), static_cast<int>(top), static_cast<int>(width), static_cast<int>(height)));
  cv::resize(part, part, cv::Size(kViewWidth, kViewHeight), 0, 0, cv::INTER_AREA);
  std::array<cv::Point2f, 4> from, to;
  for (std::size_t corner = 0; corner < 4; ++corner) {
    const bool right = corner % 2 == 1, lower = corner / 2 == 1;
    const auto x = static_cast<float>(uniform.between(0, kSlant) * kViewWidth);
    const auto y = static_cast<float>(uniform.between(0, kSlant) * kViewHeight);
    to[corner] = cv::Point2f(right ? kViewWidth : 0, lower ? kViewHeight : 0);
    from[corner] = cv::Point2f(right ? kViewWidth - x : x, lower ? kViewHeight - y : y);
  }
  cv::Mat view;
  cv::warpPerspective(part, view, cv::getPerspectiveTransform(from.data(), to.data()),
                      cv::Size(kViewWidth, kViewHeight), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  return view;
}

}  // namespace

Result<std::vector<vision::Image>> training_views(const std::string& file, std::size_t max_views) {
  const cv::Mat picture = cv::imread(file, cv::IMREAD_GRAYSCALE);
  if (picture.empty()) return Status(Reason::NOT_A_PICTURE, file);
  const double room = double{1} * picture.cols * picture.rows / (kViewWidth * kViewHeight);
  if (max_views <= 1 || picture.cols <= kViewWidth || picture.rows <= kViewHeight || room < 2)
    return std::vector<vision::Image>{to_image(picture)};
  std::vector<vision::Image> views;
  Uniform uniform(static_cast<std::uint64_t>(picture.cols) << 32 | static_cast<std::uint32_t>(picture.rows));
  const auto count = std::min(max_views, static_cast<std::size_t>(kViewsPerArea * room));
  for (std::size_t i = 0; i < count; ++i) views.push_back(to_image(look(picture, uniform)));
  return views;
}

}  // namespace relmap::vocab
