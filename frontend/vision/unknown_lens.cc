#include "frontend/vision/unknown_lens.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "frontend/vision/lens_refinement.h"
#include "proto/base/number_text.h"

namespace relmap::vision {

namespace {

constexpr double kMinFocal = 0.4, kMaxFocal = 4;  // longer sides
constexpr int kTried = 14;                        // focal lengths, each a fifth longer than the one before
constexpr int kTrialsOfEach = 300;                // samples of three points for each of them
// Of the lenses tried, those with the most inliers that are refined. A wrong lens may have more inliers at a wrong pose
// than the right one has before its distortion is known: of 47 places where pictures of a flight were sought, the first
// one led astray at 8, the best of four at one.
constexpr std::size_t kRefined = 8;
constexpr double kMaxSigma = 0.35;  // of log f
// How far k1 moves the picture's corners, as a share of their distance from the centre (one standard deviation): wide
// lenses distort most, long ones hardly.
double usual_share(const StereoCamera& picture, double f) { return std::min(0.2, 0.02 + 0.2 * corner_r2(picture, f)); }

// Priors of unedited pictures, and of pictures that were stretched or cropped. f has no prior.
LensSigmas usual(const StereoCamera& picture, double f) {
  const double share = usual_share(picture, f);
  return {.log_f = 1, .k1 = share, .k2 = 0.5 * share, .centre = 0.02, .log_aspect = 0.005};
}
LensSigmas edited(const StereoCamera& picture, double f) {
  LensSigmas sigmas = usual(picture, f);
  sigmas.centre = 0.2;
  sigmas.log_aspect = 0.3;
  return sigmas;
}
// A picture was edited if the lens that explains it best differs from a usual one by kMaxLogAspect or kMaxOffCentre,
// and by kEditedSigmas, or with a gain in cost of kTelling. (For unedited pictures the gain was 5.7 once, otherwise 3.4
// at most; for cropped pictures that kEditedSigmas did not detect it was 13.9 and more.)
constexpr double kMaxLogAspect = 0.02, kMaxOffCentre = 0.06, kEditedSigmas = 6, kTelling = 9;
constexpr double kTriedOffCentre[] = {0, -0.25, 0.25};
constexpr double kTriedShares[] = {0, -1};  // of usual_share(): no distortion, and a barrel

Vector2 centre_of(const StereoCamera& picture) { return {0.5 * (picture.width - 1), 0.5 * (picture.height - 1)}; }

// The prior of a camera with the picture's size and a focal length of about f.
LensPrior prior_of(const LensSigmas& sigmas, const StereoCamera& picture, double f) {
  const Vector2 centre = centre_of(picture);
  LensPrior prior{{f, centre.x(), centre.y(), 0, 0}};
  prior.inverse_sigma = lens_sigmas(sigmas, picture, f).cwiseInverse();
  prior.inverse_sigma[Lens::kLogF] = 0;
  return prior;
}

// Squared residuals are cut off at the gate.
double max_cost(const MotionOptions& options) { return options.gate_sigmas * options.gate_sigmas; }

struct LensFound {
  LensPrior prior;
  RefinedLens refined;
  double cost = 0;
};

// The pose and the lens under the assumption that the picture was stretched or cropped.
std::optional<LensFound> if_edited(std::span<const Correspondence> mono, const StereoCamera& picture,
                                   const MotionOptions& options, const RefinedLens& found) {
  const LensProblem::State& state = found.fit.state;
  const LensPrior prior = prior_of(edited(picture, state.lens.f), picture, state.lens.f);
  const LensProblem problem(mono, picture, prior, options);
  // The search starts from the lens that was found, and from lenses with the principal point off centre that are turned
  // so that they see the same.
  std::optional<LensFound> best;
  for (const double right : kTriedOffCentre)
    for (const double down : kTriedOffCentre) {
      LensProblem::State start = state;
      start.lens.cx += right * picture.width;
      start.lens.cy += down * picture.height;
      start.T.R = state.T.R * so3_exp({down * picture.height / state.lens.f, -right * picture.width / state.lens.f, 0});
      auto refined = refine_lens(problem, start, found.inliers, found.inliers.size() / 2);
      if (!refined.ok()) continue;
      const double cost = problem.cost(refined->fit.state, max_cost(options));
      if (!best || cost < best->cost) best = LensFound{prior, std::move(*refined), cost};
    }
  return best;
}

// Stretched and cropped pictures also fit a usual lens at a wrong pose, and fit it well, so they must be refused.
// `gain` is by how much more the usual lens costs.
Status check_unedited(const LensFound& edited, double gain, const StereoCamera& picture) {
  const Lens& lens = edited.refined.fit.state.lens;
  const Lens::Parameters off = lens.minus(edited.prior.mean);
  const Lens::Parameters sigma =
      edited.refined.fit.covariance().diagonal().tail<Lens::kParameters>().cwiseMax(0).cwiseSqrt();
  const auto beyond = [&](Lens::Parameter parameter, double limit) {
    const double by = std::abs(off[parameter]);
    return by > limit && (by > kEditedSigmas * sigma[parameter] || gain > kTelling);
  };
  if (beyond(Lens::kLogAspect, kMaxLogAspect))
    return {Reason::NO_CALIBRATION, "the picture seems to have been stretched in " +
                                        std::string(off[Lens::kLogAspect] > 0 ? "height" : "width") + " by " +
                                        number_text(100 * std::expm1(std::abs(off[Lens::kLogAspect]))) +
                                        " %: ask with one as the camera took it, or name its camera"};
  const double max_off_centre = kMaxOffCentre * std::max(picture.width, picture.height);
  if (beyond(Lens::kCx, max_off_centre) || beyond(Lens::kCy, max_off_centre))
    return {Reason::NO_CALIBRATION, "the picture seems to be part of a larger one, whose centre is at (" +
                                        number_text(lens.cx) + ", " + number_text(lens.cy) +
                                        ") of it: ask with one as the camera took it, or name its camera"};
  return {};
}

// The correspondences as a camera without distortion sees them. Those beyond the lens's turning point are left out.
struct Undistorted {
  std::vector<Correspondence> correspondences;
  std::vector<std::uint32_t> original;
};
Undistorted undistort(std::span<const Correspondence> seen, const Lens& lens) {
  Undistorted result;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto x = lens.undistort(seen[i].pixel.head<2>());
    if (!x) continue;
    Correspondence c = seen[i];
    c.pixel.head<2>() = lens.f * *x + Vector2(lens.cx, lens.cy);
    c.sigma /= lens.slope(x->squaredNorm());
    result.correspondences.push_back(c);
    result.original.push_back(static_cast<std::uint32_t>(i));
  }
  return result;
}

struct Start {
  Motion motion;
  Lens lens;
};

// The lenses with the most inliers, the best one first; at least one.
Result<std::vector<Start>> search(std::span<const Correspondence> mono, const StereoCamera& picture,
                                  const MotionOptions& options) {
  const double side = std::max(picture.width, picture.height);
  const double log_step = std::log(kMaxFocal / kMinFocal) / (kTried - 1);
  const Vector2 centre = centre_of(picture);
  MotionOptions few = options;
  few.max_trials = std::min(options.max_trials, kTrialsOfEach);
  std::vector<Start> starts;
  Status refusal;
  for (const double share : kTriedShares)
    for (int i = 0; i < kTried; ++i) {
      const double f = kMinFocal * side * std::exp(i * log_step);
      const Lens lens{f, centre.x(), centre.y(), share * usual_share(picture, f) / corner_r2(picture, f), 0};
      const Undistorted seen = undistort(mono, lens);
      auto motion =
          estimate_motion(seen.correspondences, {f, centre.x(), centre.y(), 0, picture.width, picture.height}, few);
      if (!motion.ok()) {
        if (refusal.ok()) refusal = motion.status();
        continue;
      }
      for (std::uint32_t& inlier : motion->inliers) inlier = seen.original[inlier];
      starts.push_back({*std::move(motion), lens});
    }
  if (starts.empty()) return refusal;
  std::ranges::stable_sort(starts, [](const Start& a, const Start& b) {
    return a.motion.inliers.size() != b.motion.inliers.size() ? a.motion.inliers.size() > b.motion.inliers.size()
                                                              : a.motion.rms_px < b.motion.rms_px;
  });
  if (starts.size() > kRefined) starts.resize(kRefined);
  return starts;
}

Status unknown(const std::string& why) {
  return {Reason::NO_CALIBRATION, "what is seen does not tell the lens (" + why + "): name the camera"};
}

// Refines pose and lens from each start, and returns what explains the correspondences best.
Result<LensFound> cheapest(const std::vector<Start>& starts, std::span<const Correspondence> mono,
                           const StereoCamera& picture, const MotionOptions& options) {
  const auto min_inliers = static_cast<std::size_t>(std::max(3, options.min_inliers));
  std::optional<LensFound> best;
  Status refusal;
  for (const Start& start : starts) {
    const LensPrior prior = prior_of(usual(picture, start.lens.f), picture, start.lens.f);
    const LensProblem problem(mono, picture, prior, options);
    auto refined =
        refine_lens(problem, {start.motion.T_reference_camera, start.lens}, start.motion.inliers, min_inliers);
    if (!refined.ok()) {
      if (refusal.ok()) refusal = refined.status();
      continue;
    }
    const double cost = problem.cost(refined->fit.state, max_cost(options));
    if (!best || cost < best->cost) best = LensFound{prior, *std::move(refined), cost};
  }
  if (best) return *std::move(best);
  return refusal.reason() == Reason::NO_CALIBRATION ? unknown(refusal.message()) : refusal;
}

}  // namespace

Result<MotionAndLens> estimate_motion_and_lens(std::span<const Correspondence> correspondences,
                                               const StereoCamera& picture, const MotionOptions& options) {
  std::vector<std::uint32_t> original;
  const std::vector<Correspondence> mono = left_only(correspondences, &original);
  const auto starts = search(mono, picture, options);
  if (!starts.ok()) return starts.status();
  const auto found = cheapest(*starts, mono, picture, options);
  if (!found.ok()) return found.status();
  const LensModel::State& state = found->refined.fit.state;
  const LensProblem problem(mono, picture, found->prior, options);

  const double side = std::max(picture.width, picture.height);
  if (!(state.lens.f > kMinFocal * side && state.lens.f < kMaxFocal * side))
    return unknown("its focal length would be " + number_text(state.lens.f / side) + " times the longer side");

  const LensModel::Information covariance = found->refined.fit.covariance();
  const double variance = covariance(6, 6);
  if (!covariance.allFinite() || !(variance >= 0 && variance < kMaxSigma * kMaxSigma))
    return unknown("the sigma of its focal length is " + number_text(100 * std::sqrt(std::abs(variance))) + " %");
  MotionAndLens result{marginal_motion(problem, found->refined, covariance.topLeftCorner<6, 6>(), original), state.lens,
                       std::sqrt(variance)};
  if (const auto edited = if_edited(mono, picture, options, found->refined)) {
    if (Status status = check_unedited(*edited, found->cost - edited->cost, picture); !status.ok()) return status;
  }
  if (Eigen::LLT<Matrix6>(result.motion.covariance).info() != Eigen::Success) return unknown("no pose is the best one");
  return result;
}

}  // namespace relmap::vision
