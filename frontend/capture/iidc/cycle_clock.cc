#include "frontend/capture/iidc/cycle_clock.h"

#include <algorithm>
#include <cmath>

namespace relmap::iidc {

namespace {

constexpr double kWrap = 128, kCycle = 125e-6, kTick = 1 / 24.576e6;
constexpr double kWindow = 120;      // s; older readings are dropped
constexpr double kDriftSpan = 10;    // s; with a shorter span of readings the rate is assumed to be 1
constexpr double kMinDoubt = 20e-6;  // s; scheduling adds this to any reading
constexpr double kMisfit = 0.05;     // s beyond its own doubt, for a reading to be of another clock
constexpr double kMaxDrift = 1e-3;   // crystals keep 1e-4

// The unwrapped value of `wrapped` (0 .. 128) that is nearest to `near`.
double unwrap(double wrapped, double near) { return wrapped + kWrap * std::round((near - wrapped) / kWrap); }

}  // namespace

bool is_cycle_time(std::uint32_t cycle_time) {
  return (cycle_time >> 12 & 0x1fff) < 8000 && (cycle_time & 0xfff) < 3072;
}

double cycle_seconds(std::uint32_t cycle_time) {
  return (cycle_time >> 25) + kCycle * (cycle_time >> 12 & 0x1fff) + kTick * (cycle_time & 0xfff);
}

bool CycleClock::observe(std::uint32_t cycle_time, std::int64_t before_us, std::int64_t after_us) {
  const std::int64_t middle_us = before_us + (after_us - before_us) / 2;
  const double doubt = std::max(kMinDoubt, 0.5e-6 * static_cast<double>(after_us - before_us));
  const double shown = cycle_seconds(cycle_time);
  bool fits = true;
  if (!readings_.empty()) {
    const double host = 1e-6 * static_cast<double>(middle_us - first_host_us_);
    const double expected = (host - offset_) / rate_;
    const double camera = unwrap(shown - first_camera_s_, expected);
    const double away = host - readings_.back().host_s;
    fits = std::abs(camera - expected) < kMisfit + doubt + kMaxDrift * away;
    if (fits) {
      readings_.push_back({camera, host, doubt});
      while (readings_.front().host_s < host - kWindow) readings_.pop_front();
      fit();
      return true;
    }
  }
  readings_.assign(1, {0, 0, doubt});
  first_host_us_ = middle_us;
  first_camera_s_ = shown;
  offset_ = 0;
  rate_ = 1;
  return fits;
}

void CycleClock::fit() {
  double weights = 0, mean_camera = 0, mean_host = 0;
  for (const Reading& r : readings_) {
    const double weight = 1 / (r.doubt_s * r.doubt_s);
    weights += weight;
    mean_camera += weight * r.camera_s;
    mean_host += weight * r.host_s;
  }
  mean_camera /= weights;
  mean_host /= weights;
  double square = 0, product = 0;
  for (const Reading& r : readings_) {
    const double weight = 1 / (r.doubt_s * r.doubt_s), camera = r.camera_s - mean_camera;
    square += weight * camera * camera;
    product += weight * camera * (r.host_s - mean_host);
  }
  const bool spans = readings_.back().host_s - readings_.front().host_s >= kDriftSpan && square > 0;
  rate_ = spans ? std::clamp(product / square, 1 - kMaxDrift, 1 + kMaxDrift) : 1;
  offset_ = mean_host - rate_ * mean_camera;
}

std::int64_t CycleClock::host_us(std::uint32_t cycle_time, std::int64_t near_us) const {
  const double near = 1e-6 * static_cast<double>(near_us - first_host_us_);
  const double camera = unwrap(cycle_seconds(cycle_time) - first_camera_s_, (near - offset_) / rate_);
  return first_host_us_ + std::llround(1e6 * (offset_ + rate_ * camera));
}

std::optional<double> CycleClock::drift_ppm() const {
  if (readings_.size() < 2 || readings_.back().host_s - readings_.front().host_s < kDriftSpan) return std::nullopt;
  return 1e6 * (1 / rate_ - 1);
}

double CycleClock::uncertainty_us() const {
  double min_doubt = 0;
  for (const Reading& r : readings_) min_doubt = min_doubt == 0 ? r.doubt_s : std::min(min_doubt, r.doubt_s);
  return 1e6 * min_doubt;
}

}  // namespace relmap::iidc
