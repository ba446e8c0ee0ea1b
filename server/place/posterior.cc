#include "server/place/posterior.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace relmap::place {
namespace {

constexpr double kOne = 0x1p62;
constexpr LogLikelihood kNothing = LogLikelihood{30} << 36;  // below the highest

double relative(LogLikelihood value, LogLikelihood highest) {
  return value <= highest - kNothing ? 0 : std::exp(in_nats(value - highest));
}

// An exact sum of likelihoods relative to the highest.
class LikelihoodSum {
 public:
  explicit LikelihoodSum(LogLikelihood highest) : highest_(highest) {}
  void add(LogLikelihood value) {
    const std::uint64_t term = term_of(value);
    low_ += term;
    high_ += low_ < term;
  }
  // `value` must have been added before.
  void subtract(LogLikelihood value) {
    const std::uint64_t term = term_of(value);
    high_ -= low_ < term;
    low_ -= term;
  }
  double value() const { return (static_cast<double>(high_) * 0x1p64 + static_cast<double>(low_)) / kOne; }

 private:
  std::uint64_t term_of(LogLikelihood value) const {
    return static_cast<std::uint64_t>(relative(value, highest_) * kOne);
  }
  const LogLikelihood highest_;
  std::uint64_t low_ = 0, high_ = 0;
};

}  // namespace

Posterior::Posterior(const PlaceScores& scores, std::span<const LogLikelihood> shipped,
                     std::span<const std::uint32_t> not_unknown, std::span<const std::uint32_t> expected)
    : count_(scores.candidates) {
  if (count_ == 0) return;
  for (const LogLikelihood value : scores.highest) highest_ = std::max(highest_, value);
  for (const LogLikelihood value : shipped) highest_ = std::max(highest_, value);
  LikelihoodSum places(highest_);
  for (std::size_t block = 0; block < scores.highest.size(); ++block) {
    if (scores.highest[block] <= highest_ - kNothing) continue;
    for (const LogLikelihood value : scores.of_block(block)) places.add(value);
  }
  LikelihoodSum far = places;
  std::size_t far_count = count_;
  for (const std::uint32_t place : not_unknown)
    if (const LogLikelihood value = scores.values[place]; value != kLeftOut) {
      far.subtract(value);
      --far_count;
    }
  LikelihoodSum elsewhere(highest_);
  for (const LogLikelihood value : shipped) elsewhere.add(value);

  const double unknown = (far.value() + kShippedCount * elsewhere.value() / static_cast<double>(shipped.size())) /
                         (static_cast<double>(far_count) + kShippedCount);
  LikelihoodSum at_expected(highest_);
  for (const std::uint32_t place : expected) at_expected.add(scores.values[place]);
  const PlacePriors priors(count_, expected.size());
  prior_ = priors.place;
  prior_expected_ = priors.expected;
  const double prior_new = priors.new_place;
  mean_ = prior_new * unknown + prior_ * places.value() + prior_expected_ * at_expected.value();
  // With this mean, the smoothed likelihoods, weighted by the prior, sum to the mean again.
  floor_ = (1 - kSmoothing) * mean_;
  new_place_ = prior_new * (kSmoothing * unknown + floor_) / mean_;
}

double Posterior::mass(LogLikelihood place, double prior) const {
  if (place == kLeftOut || count_ == 0) return 0;
  return prior * (kSmoothing * relative(place, highest_) + floor_) / mean_;
}

LogLikelihood Posterior::lowest_with(double mass) const {
  if (count_ == 0) return std::numeric_limits<LogLikelihood>::max();
  const double likelihood = (mass * mean_ / prior_ - floor_) / kSmoothing;
  if (likelihood <= 0x1p-80) return kLeftOut + 1;
  return highest_ + static_cast<LogLikelihood>((std::log(likelihood) - 1e-9) * kNat);
}

}  // namespace relmap::place
