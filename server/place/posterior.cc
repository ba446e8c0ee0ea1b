#include "server/place/posterior.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace relmap {
namespace {

constexpr double kOne = 0x1p62;
constexpr LogLikelihood kNothing = LogLikelihood{30} << 36;  // below the highest

double relative(LogLikelihood value, LogLikelihood highest) {
  return value <= highest - kNothing ? 0 : std::exp(in_nats(value - highest));
}

// Of likelihoods relative to the highest.
class LikelihoodSum {
 public:
  explicit LikelihoodSum(LogLikelihood highest) : highest_(highest) {}
  void add(LogLikelihood value) {
    const auto term = static_cast<std::uint64_t>(relative(value, highest_) * kOne);
    low_ += term;
    high_ += low_ < term;
  }
  double value() const { return (static_cast<double>(high_) * 0x1p64 + static_cast<double>(low_)) / kOne; }

 private:
  const LogLikelihood highest_;
  std::uint64_t low_ = 0, high_ = 0;
};

}  // namespace

Posterior::Posterior(const PlaceScores& scores, std::vector<LogLikelihood> unknown)
    : count_(scores.candidates), unknown_(std::move(unknown)) {
  if (count_ == 0) return;
  for (const LogLikelihood value : scores.highest) highest_ = std::max(highest_, value);
  for (const LogLikelihood value : unknown_) highest_ = std::max(highest_, value);
  LikelihoodSum sum(highest_);
  for (std::size_t block = 0; block < scores.highest.size(); ++block) {
    if (scores.highest[block] <= highest_ - kNothing) continue;
    for (const LogLikelihood value : scores.of_block(block)) sum.add(value);
  }
  sum_of_places_ = sum.value();
  normalise();
}

void Posterior::add_unknown(std::span<const LogLikelihood> more) {
  unknown_.insert(unknown_.end(), more.begin(), more.end());
  if (count_ > 0) normalise();
}

void Posterior::normalise() {
  LikelihoodSum sum(highest_);
  for (const LogLikelihood value : unknown_) sum.add(value);
  const double unknown = sum.value() / static_cast<double>(unknown_.size());
  prior_ = (1 - kNewPlacePrior) / static_cast<double>(count_);
  mean_ = kNewPlacePrior * unknown + prior_ * sum_of_places_;
  // With that mean the smoothed likelihoods, weighted by the prior, sum to the mean again.
  floor_ = (1 - kSmoothing) * mean_;
  new_place_ = kNewPlacePrior * (kSmoothing * unknown + floor_) / mean_;
}

double Posterior::mass(LogLikelihood place) const {
  if (place == kLeftOut) return 0;
  return prior_ * (kSmoothing * relative(place, highest_) + floor_) / mean_;
}

LogLikelihood Posterior::lowest_with(double mass) const {
  if (count_ == 0) return std::numeric_limits<LogLikelihood>::max();
  const double likelihood = (mass * mean_ / prior_ - floor_) / kSmoothing;
  if (likelihood <= 0x1p-80) return kLeftOut + 1;
  return highest_ + static_cast<LogLikelihood>((std::log(likelihood) - 1e-9) * kNat);
}

}  // namespace relmap
