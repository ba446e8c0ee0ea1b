#include "frontend/capture/imu_file.h"

#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <utility>

#include "frontend/capture/imu_csv.h"
#include "frontend/capture/text_file.h"
#include "proto/calibration/imu_calibration.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

// The first of the names that exists there; empty if none does.
fs::path first_existing(const fs::path& folder, std::initializer_list<const char*> names) {
  std::error_code error;
  for (const char* name : names)
    if (fs::exists(folder / name, error)) return folder / name;
  return {};
}

Result<fs::path> find_csv(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return fs::path(path);
  const fs::path found = find_imu(path);
  const fs::path folder = fs::is_directory(found, error) ? found : fs::path(path);
  const fs::path csv = first_existing(folder, {"data.csv", "imu.csv"});
  if (csv.empty()) return {Reason::NO_SUCH_FILE, path + " holds neither data.csv nor imu.csv of an inertial unit"};
  return csv;
}

Status named(const fs::path& path, const Status& status) {
  return {status.reason(), path.string() + ": " + status.message()};
}

Result<ImuSensor> read_sensor(const fs::path& csv) {
  const std::string own = fs::path(csv.filename()).replace_extension(".yaml").string();
  const fs::path yaml = first_existing(csv.parent_path(), {own.c_str(), "sensor.yaml"});
  if (yaml.empty())
    return {Reason::NO_SUCH_FILE, (csv.parent_path() / own).string() + " (or sensor.yaml there), with T_BS and the " +
                                      "noise of the inertial unit, is needed beside " + csv.string()};
  const auto text = read_text_file(yaml);
  if (!text.ok()) return text.status();
  auto sensor = parse_imu_calibration(*text);
  if (!sensor.ok()) return named(yaml, sensor.status());
  return sensor;
}

}  // namespace

Result<ImuRecording> read_imu(const std::string& path, const SE3& T_body_camera) {
  const auto csv = find_csv(path);
  if (!csv.ok()) return csv.status();
  const auto text = read_text_file(*csv);
  if (!text.ok()) return text.status();
  const auto sensor = read_sensor(*csv);
  if (!sensor.ok()) return sensor.status();
  auto samples = parse_imu_csv(*text);
  if (!samples.ok()) return named(*csv, samples.status());
  const auto shift_us = static_cast<std::int64_t>(std::llround(sensor->time_shift_s * 1e6));
  for (ImuSample& sample : *samples) sample.time_us -= shift_us;
  return ImuRecording{{T_body_camera.R.transpose() * sensor->T_body_imu.R, sensor->gyro_noise, sensor->gyro_walk},
                      std::move(*samples)};
}

std::string find_imu(const std::string& folder) {
  return first_existing(folder, {"mav0/imu0", "imu0", "imu.csv"}).string();
}

}  // namespace relmap::capture
