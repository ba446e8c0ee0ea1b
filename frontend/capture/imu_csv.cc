#include "frontend/capture/imu_csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "frontend/capture/capture_time.h"
#include "frontend/capture/text_file.h"

namespace relmap::capture {

namespace {

std::string_view next_field(std::string_view& line) {
  const std::size_t end = std::min(line.find(','), line.size());
  const std::string_view field = trimmed(line.substr(0, end));
  line.remove_prefix(std::min(end + 1, line.size()));
  return field;
}

Result<ImuSample> parse_sample(std::string_view line) {
  const auto time = time_from_nanoseconds(next_field(line));
  if (!time) return {Reason::CORRUPT, "no time in nanoseconds"};
  ImuSample sample;
  sample.time_us = *time;
  for (int i = 0; i < 6; ++i) {
    double& value = i < 3 ? sample.gyro[i] : sample.acceleration[i - 3];
    const std::string_view field = next_field(line);
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc{} || end != field.data() + field.size()) return {Reason::CORRUPT, "not six numbers"};
    if (!std::isfinite(value)) return {Reason::NOT_FINITE, "a number is not finite"};
  }
  if (!line.empty()) return {Reason::CORRUPT, "more than six numbers"};
  return sample;
}

}  // namespace

Result<std::vector<ImuSample>> parse_imu_csv(std::string_view text) {
  std::vector<ImuSample> samples;
  for (TextLines lines(text); lines.next();) {
    const auto sample = parse_sample(lines.line());
    if (!sample.ok()) return {sample.reason(), lines.where() + ": " + sample.status().message()};
    if (!samples.empty() && sample->time_us <= samples.back().time_us)
      return {Reason::TIME_BACKWARDS, lines.where() + ": not later than the sample before"};
    samples.push_back(*sample);
  }
  if (samples.empty()) return {Reason::BAD_SIZE, "no sample of an inertial unit"};
  return samples;
}

}  // namespace relmap::capture
