#include "frontend/vision/rotation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace relmap::vision {

namespace {

constexpr int kAlignWidth = 96;   // pixels; the finest level used is not wider
constexpr int kSearchWidth = 40;  // pixels; levels are added until the coarsest, on which shifts are searched, fits
constexpr double kSearchColumns = 0.4, kSearchRows = 0.3;
constexpr int kAlignIterations = 12;
constexpr double kConvergedTurn = 2e-4;  // radians
constexpr double kMinOverlap = 0.25;
constexpr double kSearchBelow = 0.9;  // correlation at the coarsest level, starting from the expected rotation

// A small picture with the camera that took it.
struct Small {
  Image image;
  double f = 0, cx = 0, cy = 0;
};

Small halved(ImageView image, double f, double cx, double cy) {
  return {halve(image), f / 2, (cx + 0.5) / 2 - 0.5, (cy + 0.5) / 2 - 0.5};
}

// The shift (columns, rows) at which `current` looks most like `reference`: reference (x, y) is seen at current
// (x + columns, y + rows). Its measure is the mean absolute difference over the pixels they share.
struct Shift {
  int columns = 0, rows = 0;
};
Shift best_shift(ImageView reference, ImageView current) {
  const int max_columns = static_cast<int>(kSearchColumns * reference.width);
  const int max_rows = static_cast<int>(kSearchRows * reference.height);
  Shift best;
  double min_cost = std::numeric_limits<double>::infinity();
  for (int rows = -max_rows; rows <= max_rows; ++rows)
    for (int columns = -max_columns; columns <= max_columns; ++columns) {
      const int x0 = std::max(0, -columns), x1 = std::min(reference.width, current.width - columns);
      const int y0 = std::max(0, -rows), y1 = std::min(reference.height, current.height - rows);
      int total = 0;
      for (int y = y0; y < y1; ++y) {
        const std::uint8_t *a = reference.row(y), *b = current.row(y + rows) + columns;
        for (int x = x0; x < x1; ++x) total += std::abs(a[x] - b[x]);
      }
      // Few pixels agree more easily by chance.
      const double pixels = (x1 - x0) * (y1 - y0);
      const double share = pixels / (reference.width * reference.height);
      const double cost = total / pixels / std::sqrt(share);
      if (cost < min_cost) {
        min_cost = cost;
        best = {columns, rows};
      }
    }
  return best;
}

Matrix3 rotation_of(const Shift& shift, const Small& small) {
  // R_current_reference turns the reference's optical axis to where it is seen now.
  const double yaw = std::atan2(shift.columns, small.f), pitch = -std::atan2(shift.rows, small.f);
  return so3_exp({pitch, yaw, 0});
}

// ESM at one level.
class Alignment {
 public:
  Alignment(const Small& reference, const Small& current)
      : reference_(reference),
        current_(current),
        width_(reference.image.width()),
        height_(reference.image.height()),
        warped_(static_cast<std::size_t>(width_ * height_)) {}

  struct Step {
    double correlation = 0, variance = 0;
    Vector3 turn = Vector3::Zero();
    Matrix3 information = Matrix3::Zero();
  };

  // One step of Gauss-Newton at R_current_reference; nothing if there is nothing to align.
  std::optional<Step> step(const Matrix3& R) {
    warp(R);
    return solve();
  }

 private:
  static constexpr float kOutside = -1;

  // Warps the current picture into the reference camera.
  void warp(const Matrix3& R) {
    const ImageView image = current_.image;
    const Matrix3f H = (intrinsics(current_) * R * intrinsics(reference_).inverse()).cast<float>();
    const float right = static_cast<float>(image.width - 1), bottom = static_cast<float>(image.height - 1);
    for (int y = 0; y < height_; ++y) {
      float* out = warped_.data() + y * width_;
      Eigen::Vector3f p = H * Eigen::Vector3f(0, static_cast<float>(y), 1);
      for (int x = 0; x < width_; ++x, p += H.col(0)) {
        const float u = p.x() / p.z(), v = p.y() / p.z();
        const bool inside = p.z() > 0 && u >= 0 && v >= 0 && u < right && v < bottom;
        out[x] = inside ? sample(image, u, v) : kOutside;
      }
    }
  }

  bool usable(const float* p) const {
    return p[0] >= 0 && p[-1] >= 0 && p[1] >= 0 && p[-width_] >= 0 && p[width_] >= 0;
  }

  std::optional<Step> solve() const {
    double count = 0, sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
    for (int y = 1; y + 1 < height_; ++y) {
      const std::uint8_t* a = reference_.image.row(y);
      const float* b = warped_.data() + y * width_;
      for (int x = 1; x + 1 < width_; ++x) {
        if (!usable(b + x)) continue;
        const double va = a[x], vb = b[x];
        count += 1;
        sum_a += va;
        sum_b += vb;
        aa += va * va;
        bb += vb * vb;
        ab += va * vb;
      }
    }
    if (!(count >= kMinOverlap * (width_ - 2) * (height_ - 2))) return std::nullopt;
    const double mean_a = sum_a / count, mean_b = sum_b / count;
    const double variance_a = aa / count - mean_a * mean_a, variance_b = bb / count - mean_b * mean_b;
    if (!(variance_a > 1 && variance_b > 1)) return std::nullopt;
    Step step;
    step.correlation = (ab / count - mean_a * mean_b) / std::sqrt(variance_a * variance_b);
    const auto gain = static_cast<float>(std::sqrt(variance_a / variance_b));
    // Pixels that do not fit (near or moving things) count less: Huber, with a knee at the robust deviation.
    const auto knee = static_cast<float>(
        std::max(2.0, 1.5 * std::sqrt(2 * variance_a * std::max(0.0, 1 - step.correlation)) * 0.6745));

    const float f = static_cast<float>(reference_.f);
    Eigen::Matrix<float, 6, 1> h = Eigen::Matrix<float, 6, 1>::Zero();
    Eigen::Vector3f b = Eigen::Vector3f::Zero();
    float squares = 0, weights = 0;
    for (int y = 1; y + 1 < height_; ++y) {
      const std::uint8_t *here = reference_.image.row(y), *above = reference_.image.row(y - 1),
                         *below = reference_.image.row(y + 1);
      const float* w = warped_.data() + y * width_;
      const float my = (static_cast<float>(y) - static_cast<float>(reference_.cy)) / f;
      for (int x = 1; x + 1 < width_; ++x) {
        if (!usable(w + x)) continue;
        const float residual = gain * (w[x] - static_cast<float>(mean_b)) - (here[x] - static_cast<float>(mean_a));
        const float size = std::abs(residual);
        const float weight = size <= knee ? 1 : knee / size;
        // Gradients of both, per pixel, times f.
        const float gx = 0.25F * f * (here[x + 1] - here[x - 1] + gain * (w[x + 1] - w[x - 1]));
        const float gy = 0.25F * f * (below[x] - above[x] + gain * (w[x + width_] - w[x - width_]));
        // A rotation by omega moves the ray m = (mx, my, 1) by omega x m.
        const float mx = (static_cast<float>(x) - static_cast<float>(reference_.cx)) / f;
        const float along = gx * mx + gy * my;
        const float j0 = -gy - along * my, j1 = gx + along * mx, j2 = gy * mx - gx * my;
        const float w0 = weight * j0, w1 = weight * j1, w2 = weight * j2;
        h[0] += w0 * j0;
        h[1] += w0 * j1;
        h[2] += w0 * j2;
        h[3] += w1 * j1;
        h[4] += w1 * j2;
        h[5] += w2 * j2;
        b[0] += w0 * residual;
        b[1] += w1 * residual;
        b[2] += w2 * residual;
        squares += weight * residual * residual;
        weights += weight;
      }
    }
    Matrix3f H;
    H << h[0], h[1], h[2], h[1], h[3], h[4], h[2], h[4], h[5];
    step.information = H.cast<double>();
    step.turn = -step.information.ldlt().solve(b.cast<double>());
    step.variance = squares / std::max(1.0F, weights);
    if (!step.turn.allFinite()) return std::nullopt;
    return step;
  }

  using Matrix3f = Eigen::Matrix3f;
  static Matrix3 intrinsics(const Small& s) {
    Matrix3 K;
    K << s.f, 0, s.cx, 0, s.f, s.cy, 0, 0, 1;
    return K;
  }

  const Small &reference_, &current_;
  int width_, height_;
  std::vector<float> warped_;
};

struct Aligned {
  Matrix3 R_current_reference;
  Alignment::Step step;
};

std::optional<Aligned> align_level(const Small& reference, const Small& current, Matrix3 R, int iterations) {
  Alignment alignment(reference, current);
  std::optional<Aligned> best;
  for (int i = 0; i < iterations; ++i) {
    const auto step = alignment.step(R);
    if (!step) break;
    if (best && step->correlation < best->step.correlation - 0.02) break;  // it diverges
    best = Aligned{R, *step};
    if (step->turn.norm() < kConvergedTurn) break;
    const double max_step = 0.15;  // radians
    R = R * so3_exp(step->turn * std::min(1.0, max_step / step->turn.norm()));
  }
  return best;
}

}  // namespace

std::optional<RotationEstimate> align_rotation(const Pyramid& reference, const Pyramid& current,
                                               const StereoCamera& camera, const Matrix3& expected) {
  if (reference.levels() == 0 || current.levels() == 0) return std::nullopt;
  // Levels from the finest one that is small enough to the coarsest.
  std::vector<std::pair<Small, Small>> levels;
  double f = camera.f, cx = camera.cx, cy = camera.cy;
  ImageView a = reference.level(0), b = current.level(0);
  const int top = std::min(reference.levels(), current.levels()) - 1;
  int level = 0;
  const auto go_up = [&] {
    f /= 2;
    cx = (cx + 0.5) / 2 - 0.5;
    cy = (cy + 0.5) / 2 - 0.5;
    ++level;
  };
  while (level < top && a.width > kAlignWidth) {
    go_up();
    a = reference.level(level);
    b = current.level(level);
  }
  levels.emplace_back(Small{copy_of(a), f, cx, cy}, Small{copy_of(b), f, cx, cy});
  while (levels.back().first.image.width() > kAlignWidth) {
    const auto& [fine, fine_current] = levels.back();
    levels.back() =
        std::pair{halved(fine.image, fine.f, fine.cx, fine.cy), halved(fine_current.image, fine.f, fine.cx, fine.cy)};
  }
  while (levels.back().first.image.width() > kSearchWidth &&
         std::min(levels.back().first.image.height(), levels.back().second.image.height()) >= 12) {
    const auto& [fine, fine_current] = levels.back();
    auto coarse =
        std::pair{halved(fine.image, fine.f, fine.cx, fine.cy), halved(fine_current.image, fine.f, fine.cx, fine.cy)};
    levels.push_back(std::move(coarse));
  }

  const auto& [coarse, coarse_current] = levels.back();
  auto best = align_level(coarse, coarse_current, expected.transpose(), 6);
  if (!best || best->step.correlation < kSearchBelow) {
    const Shift shift = best_shift(coarse.image, coarse_current.image);
    auto aligned = align_level(coarse, coarse_current, rotation_of(shift, coarse), 6);
    if (aligned && (!best || aligned->step.correlation > best->step.correlation)) best = std::move(aligned);
  }
  if (!best) return std::nullopt;
  for (auto pair = levels.rbegin() + 1; pair != levels.rend(); ++pair) {
    auto finer = align_level(pair->first, pair->second, best->R_current_reference, kAlignIterations);
    if (!finer) return std::nullopt;
    best = std::move(finer);
  }
  RotationEstimate estimate;
  estimate.R_reference_current = best->R_current_reference.transpose();
  estimate.correlation = best->step.correlation;
  const Matrix3 covariance = best->step.variance * best->step.information.inverse();
  estimate.sigma = std::sqrt(covariance.trace() / 3);
  if (!std::isfinite(estimate.sigma)) return std::nullopt;
  return estimate;
}

}  // namespace relmap::vision
