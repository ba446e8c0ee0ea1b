#include "frontend/vision/motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>
#include <optional>
#include <string>

#include "frontend/vision/likeliest_point.h"
#include "frontend/vision/robust_refinement.h"
#include "frontend/vision/three_point.h"

namespace relmap::vision {

namespace {

constexpr double kMinDepth = 1e-3;  // metres; nothing nearer can be seen
constexpr double kConfidence = 0.999;
constexpr std::size_t kSample = 3;  // correspondences; fewer determine no pose
constexpr int kCorrections = 3;     // of the points, and of the pose after each

// The derivative is by the right perturbation of T_reference_camera; the covariance includes the point's own.
using Residual = CorrespondenceResidual<6>;

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
    if (!(p.z() > kMinDepth)) return r;
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

  bool passes(const Residual& r) const { return agrees(r, options_.gate_sigmas, camera_.width); }

  // Truncated squared error over all correspondences (MSAC), and the number of inliers. An uncertain point passes the
  // gate of many poses and supports none of them much, so it counts for less.
  struct Score {
    double cost = std::numeric_limits<double>::infinity();
    std::size_t inliers = 0;
    double share = 0;  // weight of the inliers / weight of all
  };
  // Ends early, with an infinite cost, once the cost is `too_much`.
  Score score(const SE3& T_reference_camera, double too_much) const {
    const SE3 inverse = T_reference_camera.inverse();
    const double max_cost = options_.gate_sigmas * options_.gate_sigmas;
    Score result{0, 0, 0};
    double all_weight = 0, inlier_weight = 0;
    for (const Correspondence& c : all_) {
      const Residual r = residual(inverse, c, false);
      const double w = weight(r, c.sigma);
      all_weight += w;
      if (!passes(r)) {
        result.cost += max_cost;
      } else {
        double worst = 0;
        for (int k = 0; k < r.rows; ++k) worst = std::max(worst, r.value[k] * r.value[k] / r.covariance(k, k));
        result.cost += max_cost - w * (max_cost - worst);
        inlier_weight += w;
        ++result.inliers;
      }
      if (!(result.cost < too_much)) return {};
    }
    if (all_weight > 0) result.share = inlier_weight / all_weight;
    return result;
  }

  // How much an inlier supports a pose, relative to one whose point is exact: the log-likelihood ratio of its residual
  // against a uniform distribution over the picture (MLESAC; Torr and Zisserman, CVIU 2000).
  double weight(const Residual& r, double sigma) const {
    const double variance = sigma * sigma, spread = std::sqrt(r.covariance(0, 0) * r.covariance(1, 1));
    if (r.rows == 0 || spread == variance) return 1;
    const double anywhere = static_cast<double>(camera_.width) * camera_.height / (2 * std::numbers::pi);
    return std::clamp(std::log(anywhere / spread) / std::log(anywhere / variance), 0.0, 1.0);
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

// The M-estimate of the pose over `active`.
class PoseModel {
 public:
  static constexpr int kParameters = 6;
  using State = SE3;  // T_reference_camera

  PoseModel(const Problem& problem, const std::vector<std::uint32_t>& active) : problem_(problem), active_(active) {}

  std::size_t size() const { return active_.size(); }
  auto at(const SE3& T) const {
    return [this, inverse = T.inverse()](std::size_t k, bool with_jacobian) {
      return problem_.residual(inverse, problem_[active_[k]], with_jacobian);
    };
  }
  SE3 plus(const SE3& T, const Vector6& xi) const { return T * SE3::exp(xi); }
  SE3 normalized(const SE3& T) const { return T.normalized(); }
  double prior_cost(const SE3&) const { return 0; }
  void add_prior(const SE3&, Matrix6&, Vector6&) const {}

 private:
  const Problem& problem_;
  const std::vector<std::uint32_t>& active_;
};

std::optional<Refined<PoseModel>> refine_pose(const Problem& problem, const std::vector<std::uint32_t>& active,
                                              const SE3& T, int iterations) {
  return refine(PoseModel(problem, active), T, iterations);
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

// Draws samples of three. For ordered correspondences it does so by PROSAC: sample t comes from the first n(t)
// correspondences and contains the n(t)-th. n(t) grows so that after the maximum number of trials, as many samples have
// been drawn from the first n correspondences, for each n, as uniform sampling would draw from them.
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

// Up to four poses, from three points and their left pixels.
ThreePointPoses poses_of(const Problem& problem, const std::array<std::size_t, 3>& sample) {
  const StereoCamera& camera = problem.camera();
  std::array<Vector3, 3> points, rays;
  for (std::size_t k = 0; k < 3; ++k) {
    const Correspondence& c = problem[sample[k]];
    points[k] = c.point;
    rays[k] = {(c.pixel.x() - camera.cx) / camera.f, (c.pixel.y() - camera.cy) / camera.f, 1};
  }
  return three_point_poses(points, rays);
}

std::size_t trials_needed(double inlier_ratio, int max_trials) {
  const double good = inlier_ratio * inlier_ratio * inlier_ratio;
  if (good >= 1) return 1;
  if (good < 1e-12) return static_cast<std::size_t>(max_trials);
  const double trials = std::log(1 - kConfidence) / std::log(1 - good);
  return static_cast<std::size_t>(std::clamp(std::ceil(trials), 1.0, static_cast<double>(max_trials)));
}

struct Best {
  SE3 T;
  Problem::Score score;
};

Best search(const Problem& problem, const MotionOptions& options, const SE3* guess) {
  Best best;
  const auto consider = [&](const SE3& T) {
    if (options.limits && !options.limits->allow(T)) return false;
    const Problem::Score score = problem.score(T, best.score.cost);
    if (!(score.cost < best.score.cost)) return false;
    best = {T, score};
    return true;
  };
  // A new best pose is refined on its own inliers at once, so that few trials suffice (Chum et al., DAGM 2003).
  const auto polish = [&] {
    for (int round = 0; round < 2 && best.score.inliers >= 6; ++round) {
      const auto refined = refine_pose(problem, problem.inliers(best.T), best.T, 3);
      if (!refined || !consider(refined->state)) break;
    }
  };
  if (guess && consider(*guess)) polish();
  if (best.score.share >= options.enough) return best;
  ProgressiveSampler sampler(problem.size(), options);
  for (std::size_t trial = 0;; ++trial) {
    if (trial >= trials_needed(best.score.share, options.max_trials)) break;
    const std::array<std::size_t, 3> sample = sampler.next();
    bool better = false;
    for (const SE3& T_camera_reference : poses_of(problem, sample)) better |= consider(T_camera_reference.inverse());
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
  const auto min_inliers = std::max(kSample, static_cast<std::size_t>(std::max(0, options.min_inliers)));
  if (good.size() < min_inliers) return too_few(0, good.size());

  const Problem problem(good, camera, options);
  Best best = search(problem, options, guess);
  auto inliers = problem.inliers(best.T);

  // The inliers are counted once they no longer change: the first step of a refinement may lose some that the next ones
  // find again.
  std::optional<Refined<PoseModel>> refined;
  for (int round = 0; round < 4 && inliers.size() >= kSample; ++round) {
    refined = refine_pose(problem, inliers, best.T, 10);
    if (!refined) return {Reason::TOO_FEW_INLIERS, "the correspondences do not determine a pose"};
    best.T = refined->state;
    auto again = problem.inliers(best.T);
    const bool unchanged = again == inliers;
    inliers = std::move(again);
    if (unchanged) break;
  }
  if (!refined || inliers.size() < min_inliers) return too_few(inliers.size(), good.size());

  std::vector<std::uint32_t> uncertain;
  if (options.correct_points)
    std::ranges::copy_if(inliers, std::back_inserter(uncertain),
                         [&](std::uint32_t i) { return !is_well_known(good[i]); });
  if (!uncertain.empty()) {
    const std::vector<Correspondence> measured = good;
    for (int round = 0; round < kCorrections; ++round) {
      const SE3 inverse = best.T.inverse();
      const std::vector<Correspondence> before = good;
      for (const std::uint32_t i : uncertain) good[i] = at_likeliest_point(measured[i], camera, inverse);
      const auto better = refine_pose(problem, inliers, best.T, 10);
      if (!better) {
        std::ranges::copy(before, good.begin());
        break;
      }
      refined = better;
      best.T = refined->state;
    }
  }
  if (options.limits && !options.limits->allow(best.T)) return too_few(0, good.size());

  Motion motion;
  motion.T_reference_camera = best.T;
  motion.variance_factor = refined->variance_factor();
  motion.covariance = refined->covariance();
  if (!motion.covariance.allFinite() || Eigen::LLT<Matrix6>(motion.covariance).info() != Eigen::Success)
    return {Reason::TOO_FEW_INLIERS, "the correspondences do not determine a pose"};
  double squares = 0;
  int rows = 0;
  const SE3 inverse = best.T.inverse();
  for (const std::uint32_t i : inliers) {
    const Residual r = problem.residual(inverse, good[i], false);
    squares += r.value.squaredNorm();
    rows += r.rows;
    motion.inliers.push_back(original[i]);
  }
  motion.rms_px = std::sqrt(squares / std::max(1, rows));
  return motion;
}

}  // namespace relmap::vision
