#include "frontend/imu_feed.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "frontend/capture/imu_file.h"

namespace relmap::frontend {

Result<std::optional<ImuFeed>> ImuFeed::open(const std::string& wanted, const capture::StereoSource& source,
                                             bool quiet) {
  if (wanted == "none") return std::optional<ImuFeed>();
  const bool chosen = wanted != "auto";
  const std::string path = chosen ? wanted : source.imu();
  if (path.empty()) return std::optional<ImuFeed>();
  auto recording = capture::read_imu(path, source.calibration().T_body_left);
  if (!recording.ok()) {
    if (chosen) return recording.status();
    std::fprintf(stderr, "without the data set's gyro: %s\n", recording.status().to_string().c_str());
    return std::optional<ImuFeed>();
  }
  if (!quiet) std::fprintf(stderr, "gyro: %s, %zu samples\n", path.c_str(), recording->samples.size());
  return std::optional(ImuFeed(std::move(*recording)));
}

std::span<const ImuSample> ImuFeed::until(std::int64_t time_us) {
  const std::span<const ImuSample> left = std::span(recording_.samples).subspan(next_);
  auto end = std::lower_bound(left.begin(), left.end(), time_us,
                              [](const ImuSample& sample, std::int64_t time) { return sample.time_us < time; });
  if (end != left.end()) ++end;
  const auto count = static_cast<std::size_t>(end - left.begin());
  next_ += count;
  return left.first(count);
}

}  // namespace relmap::frontend
