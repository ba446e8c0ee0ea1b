#include "tools/sim/measures.h"

#include <algorithm>
#include <cassert>
#include <numbers>

namespace relmap::sim {

namespace {

constexpr std::int64_t kRevisitUs = 10'000'000;
constexpr std::size_t kRevisitFrames = 20;
constexpr double kRevisitMetres = 1;
constexpr double kRevisitRadians = 30 * std::numbers::pi / 180;

}  // namespace

RegistrationError registration_error(const std::vector<SE3>& truth, const Unroll& unroll, std::size_t stride) {
  assert(stride > 0);
  RegistrationError error;
  for (std::size_t root = 0; root < truth.size(); root += stride) {
    const auto unrolled = unroll(root);
    assert(unrolled.size() == truth.size());
    double sum = 0;
    std::size_t terms = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      if (!unrolled[i]) {
        ++error.disconnected;
        continue;
      }
      sum += (truth[root] * unrolled[i]->t - truth[i].t).norm();
      ++terms;
    }
    if (terms > 0) error.mean_m += sum / static_cast<double>(terms);
    ++error.roots;
  }
  if (error.roots > 0) error.mean_m /= static_cast<double>(error.roots);
  return error;
}

std::vector<Revisit> find_revisits(const std::vector<SE3>& truth, const std::vector<std::int64_t>& time_us) {
  assert(truth.size() == time_us.size());
  std::vector<Revisit> revisits;
  for (std::size_t i = kRevisitFrames + 1; i < truth.size(); ++i) {
    double min_distance = kRevisitMetres;
    std::optional<std::size_t> earlier;
    for (std::size_t k = 0; k + kRevisitFrames < i && time_us[i] - time_us[k] > kRevisitUs; ++k) {
      const double distance = (truth[k].t - truth[i].t).norm();
      if (distance >= min_distance || rotation_angle(truth[k].R.transpose() * truth[i].R) > kRevisitRadians) continue;
      min_distance = distance;
      earlier = k;
    }
    if (earlier) revisits.push_back({i, *earlier});
  }
  return revisits;
}

RevisitError revisit_error(const std::vector<SE3>& truth, const std::vector<Revisit>& revisits,
                           const RelativePose& relative) {
  RevisitError error;
  for (const Revisit& revisit : revisits) {
    const auto estimate = relative(revisit.earlier, revisit.frame);
    if (!estimate) {
      ++error.disconnected;
      continue;
    }
    const SE3 expected = truth[revisit.earlier].inverse() * truth[revisit.frame];
    const double metres = (estimate->t - expected.t).norm();
    error.mean_m += metres;
    error.max_m = std::max(error.max_m, metres);
    error.mean_rad += rotation_angle(expected.R.transpose() * estimate->R);
    ++error.revisits;
  }
  if (error.revisits > 0) {
    error.mean_m /= static_cast<double>(error.revisits);
    error.mean_rad /= static_cast<double>(error.revisits);
  }
  return error;
}

}  // namespace relmap::sim
