#include "frontend/vision/motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

namespace relmap {

namespace {

constexpr double kNearest = 1e-3;  // metres; nothing nearer can be seen
// Of the picture's width: a point that might appear so far off agrees with any pose, one just before the eye with a
// covariance that has no inverse.
constexpr double kMostUncertain = 1;
constexpr double kHuber = 1.5;  // of the Mahalanobis norm divided by the root of its dimension
constexpr double kConfidence = 0.999;
constexpr std::size_t kSample = 3;  // correspondences; fewer determine no pose

// One correspondence seen from a hypothesis: residual, its Jacobian by the right perturbation of T_reference_camera,
// and its covariance, widened by the point's own.
struct Residual {
  int rows = 0;  // 2 or 3; 0: the point is behind the camera
  Vector3 value = Vector3::Zero();
  Eigen::Matrix<double, 3, 6> jacobian;
  Matrix3 covariance;
};

class Problem {
 public:
  Problem(std::span<const Correspondence> all, const StereoCamera& camera, const MotionOptions& options)
      : all_(all), camera_(camera), options_(options) {}

  std::size_t size() const { return all_.size(); }
  const Correspondence& operator[](std::size_t i) const { return all_[i]; }
  const StereoCamera& camera() const { return camera_; }
  bool stereo(const Correspondence& c) const { return !is_mono(c.pixel) && camera_.is_stereo(); }

  Residual residual(const SE3& T_camera_reference, const Correspondence& c, bool with_jacobian) const {
    Residual r;
    const Vector3 p = T_camera_reference * c.point;
    if (!(p.z() > kNearest)) return r;
    r.rows = stereo(c) ? 3 : 2;
    const StereoPixel predicted = camera_.project(p);
    r.value = c.pixel - predicted;
    const Matrix3 H = camera_.jacobian(p);
    r.covariance = c.sigma * c.sigma * Matrix3::Identity();
    if (!c.point_covariance.isZero(0)) {
      const Matrix3 HR = H * T_camera_reference.R;
      r.covariance += HR * c.point_covariance * HR.transpose();
    }
    if (with_jacobian) {
      // p(xi) = p - rho + [p]x phi, and the residual is measurement minus prediction.
      r.jacobian.leftCols<3>() = H;
      r.jacobian.rightCols<3>() = -H * skew(p);
    }
    if (r.rows == 2) {
      r.value.z() = 0;
      r.covariance.row(2).setZero();
      r.covariance.col(2).setZero();
      r.covariance(2, 2) = 1;
      if (with_jacobian) r.jacobian.row(2).setZero();
    }
    return r;
  }

  bool passes(const Residual& r) const {
    const double g2 = options_.gate_sigmas * options_.gate_sigmas;
    const double most_sigma = kMostUncertain * camera_.width;
    for (int k = 0; k < r.rows; ++k)
      if (!(r.value[k] * r.value[k] <= g2 * r.covariance(k, k) && r.covariance(k, k) <= most_sigma * most_sigma))
        return false;
    return r.rows > 0;
  }

  // Truncated squared error over all (MSAC), and how many are inside the gate.
  struct Score {
    double cost = std::numeric_limits<double>::infinity();
    std::size_t inliers = 0;
  };
  Score score(const SE3& T_reference_camera) const {
    const SE3 inverse = T_reference_camera.inverse();
    const double most = options_.gate_sigmas * options_.gate_sigmas;
    Score result{0, 0};
    for (const Correspondence& c : all_) {
      const Residual r = residual(inverse, c, false);
      if (!passes(r)) {
        result.cost += most;
        continue;
      }
      double worst = 0;
      for (int k = 0; k < r.rows; ++k) worst = std::max(worst, r.value[k] * r.value[k] / r.covariance(k, k));
      result.cost += worst;
      ++result.inliers;
    }
    return result;
  }

  std::vector<std::uint32_t> inliers(const SE3& T_reference_camera) const {
    const SE3 inverse = T_reference_camera.inverse();
    std::vector<std::uint32_t> result;
    for (std::size_t i = 0; i < all_.size(); ++i)
      if (passes(residual(inverse, all_[i], false))) result.push_back(static_cast<std::uint32_t>(i));
    return result;
  }

 private:
  std::span<const Correspondence> all_;
  const StereoCamera& camera_;
  const MotionOptions& options_;
};

double huber_weight(double squared, int rows) {
  const double norm = std::sqrt(squared / rows);
  return norm <= kHuber ? 1 : kHuber / norm;
}
double huber_cost(double squared, int rows) {
  const double norm = std::sqrt(squared / rows);
  return rows * (norm <= kHuber ? norm * norm : 2 * kHuber * norm - kHuber * kHuber);
}

// The M-estimate over `active`: Levenberg-Marquardt on Huber's cost. The covariances are those at the beginning: if
// they went with the pose, a pose that sees everything uncertainly would cost the least.
struct Refined {
  SE3 T;
  Matrix6 information = Matrix6::Zero();
  double weighted_squares = 0;  // of the whitened residuals
  int rows = 0;
};

std::optional<Refined> refine(const Problem& problem, const std::vector<std::uint32_t>& active, SE3 T, int iterations) {
  std::vector<Matrix3> information;
  for (const std::uint32_t i : active)
    information.push_back(problem.residual(T.inverse(), problem[i], false).covariance.inverse());
  const auto cost_at = [&](const SE3& pose) {
    const SE3 inverse = pose.inverse();
    double cost = 0;
    for (std::size_t k = 0; k < active.size(); ++k) {
      const Residual r = problem.residual(inverse, problem[active[k]], false);
      if (r.rows == 0) return std::numeric_limits<double>::infinity();
      cost += huber_cost(r.value.dot(information[k] * r.value), r.rows);
    }
    return cost;
  };
  Refined result{T};
  double lambda = 1e-6;
  double cost = cost_at(T);
  if (!std::isfinite(cost)) return std::nullopt;
  for (int iteration = 0; iteration <= iterations; ++iteration) {
    const SE3 inverse = T.inverse();
    Matrix6 A = Matrix6::Zero();
    Vector6 b = Vector6::Zero();
    result.weighted_squares = 0;
    result.rows = 0;
    for (std::size_t k = 0; k < active.size(); ++k) {
      const Residual r = problem.residual(inverse, problem[active[k]], true);
      const double squared = r.value.dot(information[k] * r.value);
      const double w = huber_weight(squared, r.rows);
      const Eigen::Matrix<double, 6, 3> JtW = w * r.jacobian.transpose() * information[k];
      A += JtW * r.jacobian;
      b += JtW * r.value;
      result.weighted_squares += w * squared;
      result.rows += r.rows;
    }
    result.T = T;
    result.information = A;
    if (iteration == iterations) break;
    bool moved = false;
    for (int attempt = 0; attempt < 6 && !moved; ++attempt) {
      Matrix6 damped = A;
      damped.diagonal() += lambda * A.diagonal();
      // The residual falls along +J by our sign: value(xi) = value + J xi.
      const Vector6 xi = -damped.ldlt().solve(b);
      if (!xi.allFinite()) return std::nullopt;
      const SE3 candidate = T * SE3::exp(xi);
      const double candidate_cost = cost_at(candidate);
      if (candidate_cost <= cost) {
        const bool converged = xi.norm() < 1e-7;
        T = candidate.normalized();
        cost = candidate_cost;
        lambda = std::max(1e-9, lambda * 0.1);
        moved = true;
        if (converged) iteration = iterations - 1;
      } else {
        lambda = std::max(1e-4, lambda * 10);
      }
    }
    if (!moved) iteration = iterations - 1;  // as good as it gets: once more for the information
  }
  return result;
}

class Random {  // splitmix64
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::size_t below(std::size_t n) {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    z ^= z >> 31;
    return static_cast<std::size_t>(((z >> 32) * n) >> 32);
  }

 private:
  std::uint64_t state_;
};

// Samples of three. Of ordered correspondences by PROSAC: the t-th comes from the first n(t) correspondences and holds
// the n(t)-th, where n(t) grows so that after as many trials as are allowed, samples have been drawn from every first n
// as often as uniform ones would be.
class ProgressiveSampler {
 public:
  ProgressiveSampler(std::size_t count, const MotionOptions& options)
      : random_(options.seed), count_(count), pool_(options.ordered ? std::min(kFirstPool, count) : count) {
    expected_ = kProgressive * options.max_trials;
    for (std::size_t i = 0; i < 3; ++i) expected_ *= static_cast<double>(pool_ - i) / static_cast<double>(count_ - i);
  }

  std::array<std::size_t, 3> next() {
    ++trial_;
    while (pool_ < count_ && trial_ > allowed_) {
      const double more = expected_ * static_cast<double>(pool_ + 1) / static_cast<double>(pool_ - 2);
      allowed_ += std::max(1.0, std::ceil(more - expected_));
      expected_ = more;
      ++pool_;
    }
    if (pool_ < count_) {
      std::array<std::size_t, 3> sample = distinct(pool_ - 1);
      sample[2] = pool_ - 1;
      return sample;
    }
    return distinct(count_);
  }

 private:
  static constexpr std::size_t kFirstPool = 8;
  static constexpr double kProgressive = 2;

  std::array<std::size_t, 3> distinct(std::size_t n) {
    std::array<std::size_t, 3> sample{random_.below(n), random_.below(n - 1), random_.below(n - 2)};
    if (sample[1] >= sample[0]) ++sample[1];
    const auto [low, high] = std::minmax(sample[0], sample[1]);
    if (sample[2] >= low) ++sample[2];
    if (sample[2] >= high) ++sample[2];
    return sample;
  }

  Random random_;
  std::size_t count_, pool_;
  double expected_, allowed_ = 1, trial_ = 0;
};

// Poses from three points and their left pixels (Ke and Roumeliotis, CVPR 2017): up to four.
std::vector<SE3> three_point(const Problem& problem, const std::array<std::size_t, 3>& sample) {
  std::vector<SE3> poses;
  std::array<cv::Point3d, 3> points;
  std::array<cv::Point2d, 3> rays;
  for (std::size_t k = 0; k < 3; ++k) {
    const Correspondence& c = problem[sample[k]];
    points[k] = {c.point.x(), c.point.y(), c.point.z()};
    rays[k] = {(c.pixel.x() - problem.camera().cx) / problem.camera().f,
               (c.pixel.y() - problem.camera().cy) / problem.camera().f};
  }
  try {
    std::vector<cv::Mat> rotations, translations;
    static const cv::Matx33d kIdentity = cv::Matx33d::eye();
    cv::solveP3P(points, rays, kIdentity, cv::noArray(), rotations, translations, cv::SOLVEPNP_AP3P);
    for (std::size_t k = 0; k < rotations.size(); ++k) {
      const cv::Mat &r = rotations[k], &t = translations[k];
      const SE3 T_camera_reference{so3_exp({r.at<double>(0), r.at<double>(1), r.at<double>(2)}),
                                   {t.at<double>(0), t.at<double>(1), t.at<double>(2)}};
      if (T_camera_reference.R.allFinite() && T_camera_reference.t.allFinite())
        poses.push_back(T_camera_reference.inverse());
    }
  } catch (const cv::Exception&) {
    poses.clear();  // a degenerate sample
  }
  return poses;
}

std::size_t trials_needed(double inlier_ratio, int most) {
  const double good = inlier_ratio * inlier_ratio * inlier_ratio;
  if (good >= 1) return 1;
  if (good < 1e-12) return static_cast<std::size_t>(most);
  const double trials = std::log(1 - kConfidence) / std::log(1 - good);
  return static_cast<std::size_t>(std::clamp(std::ceil(trials), 1.0, static_cast<double>(most)));
}

bool usable(const Correspondence& c) {
  return c.point.allFinite() && std::isfinite(c.pixel.x()) && std::isfinite(c.pixel.y()) && !std::isinf(c.pixel.z()) &&
         std::isfinite(c.sigma) && c.sigma > 0 && c.point_covariance.allFinite();
}

struct Best {
  SE3 T;
  Problem::Score score;
};

Best search(const Problem& problem, const MotionOptions& options, const SE3* guess) {
  Best best;
  const auto consider = [&](const SE3& T) {
    if (options.limits && !options.limits->allow(T)) return false;
    const Problem::Score score = problem.score(T);
    if (!(score.cost < best.score.cost)) return false;
    best = {T, score};
    return true;
  };
  // A new best is polished on its own inliers at once, so that few trials suffice (Chum et al., DAGM 2003).
  const auto polish = [&] {
    for (int round = 0; round < 2 && best.score.inliers >= 6; ++round) {
      const auto refined = refine(problem, problem.inliers(best.T), best.T, 3);
      if (!refined || !consider(refined->T)) break;
    }
  };
  if (guess && consider(*guess)) polish();
  const std::size_t n = problem.size();
  if (static_cast<double>(best.score.inliers) >= options.enough * static_cast<double>(n)) return best;
  ProgressiveSampler sampler(n, options);
  for (std::size_t trial = 0;; ++trial) {
    const double ratio = static_cast<double>(best.score.inliers) / static_cast<double>(n);
    if (trial >= trials_needed(ratio, options.max_trials)) break;
    const std::array<std::size_t, 3> sample = sampler.next();
    bool better = false;
    for (const SE3& T : three_point(problem, sample)) better |= consider(T);
    if (better) polish();
  }
  return best;
}

Status too_few(std::size_t inliers, std::size_t of) {
  return {Reason::TOO_FEW_INLIERS, std::to_string(inliers) + " of " + std::to_string(of) + " correspondences agree"};
}

}  // namespace

Result<Motion> estimate_motion(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                               const MotionOptions& options, const SE3* guess) {
  std::vector<std::uint32_t> original;
  std::vector<Correspondence> good;
  for (std::size_t i = 0; i < correspondences.size(); ++i)
    if (usable(correspondences[i])) {
      original.push_back(static_cast<std::uint32_t>(i));
      good.push_back(correspondences[i]);
    }
  const auto least = std::max(kSample, static_cast<std::size_t>(std::max(0, options.min_inliers)));
  if (good.size() < least) return too_few(0, good.size());

  const Problem problem(good, camera, options);
  Best best = search(problem, options, guess);
  auto inliers = problem.inliers(best.T);

  // They are counted once they are settled: the first step of a refinement may lose some that the next ones find again.
  Refined refined;
  for (int round = 0; round < 4 && inliers.size() >= kSample; ++round) {
    const auto next = refine(problem, inliers, best.T, 10);
    if (!next) return {Reason::TOO_FEW_INLIERS, "the correspondences do not determine a pose"};
    refined = *next;
    best.T = refined.T;
    auto again = problem.inliers(refined.T);
    const bool settled = again == inliers;
    inliers = std::move(again);
    if (settled) break;
  }
  if (inliers.size() < least) return too_few(inliers.size(), good.size());
  if (options.limits && !options.limits->allow(refined.T)) return too_few(0, good.size());

  Motion motion;
  motion.T_reference_camera = refined.T;
  // Where the residuals are larger than their sigmas promise, so is the uncertainty.
  motion.variance_factor = refined.weighted_squares / std::max(1, refined.rows - 6);
  const Eigen::LDLT<Matrix6> factor(refined.information);
  motion.covariance = std::max(1.0, motion.variance_factor) * factor.solve(Matrix6::Identity());
  motion.covariance = 0.5 * (motion.covariance + motion.covariance.transpose()).eval();
  if (!motion.covariance.allFinite() || Eigen::LLT<Matrix6>(motion.covariance).info() != Eigen::Success)
    return {Reason::TOO_FEW_INLIERS, "the correspondences do not determine a pose"};
  double squares = 0;
  int rows = 0;
  const SE3 inverse = refined.T.inverse();
  for (const std::uint32_t i : inliers) {
    const Residual r = problem.residual(inverse, good[i], false);
    squares += r.value.squaredNorm();
    rows += r.rows;
    motion.inliers.push_back(original[i]);
  }
  motion.rms_px = std::sqrt(squares / std::max(1, rows));
  return motion;
}

}  // namespace relmap
