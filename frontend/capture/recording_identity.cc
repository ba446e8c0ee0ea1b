#include "frontend/capture/recording_identity.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "frontend/capture/contents_checksum.h"
#include "frontend/capture/keyframe_file.h"
#include "proto/base/hex.h"
#include "proto/base/number_text.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

// Files up to this size are read: calibrations of inertial units may be corrected without changing their size.
constexpr std::uintmax_t kReadWhole = 64 * 1024;
// Bytes of a keyframe that are read: session, sequence, time, pose and some of the tracks.
constexpr std::size_t kKeyframeBeginning = 1024;

void add_file(ContentsChecksum& checksum, const fs::path& file) {
  checksum.add_file(file);
  std::error_code error;
  const auto size = fs::file_size(file, error);
  if (error || size > kReadWhole) return;
  std::ifstream in(file, std::ios::binary);
  checksum.add(std::string{std::istreambuf_iterator<char>(in), {}});
}

// A file and the calibrations beside it, or a folder of them (imu_file.h).
void add_imu(ContentsChecksum& checksum, const fs::path& imu) {
  std::error_code error;
  if (!fs::is_directory(imu, error)) {
    for (const fs::path& file : {imu, fs::path(imu).replace_extension(".yaml"), imu.parent_path() / "sensor.yaml"})
      add_file(checksum, file);
    return;
  }
  std::vector<fs::path> files;
  for (fs::directory_iterator entry(imu, error), end; !error && entry != end; entry.increment(error))
    if (entry->is_regular_file(error)) files.push_back(entry->path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) add_file(checksum, file);
}

void add_camera(ContentsChecksum& checksum, const RawCamera& c) {
  for (const double value : {c.fx, c.fy, c.cx, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3}) checksum.add(value);
}

void add_pose(ContentsChecksum& checksum, const SE3& T) {
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) checksum.add(T.R(i, k));
  for (int i = 0; i < 3; ++i) checksum.add(T.t(i));
}

// "focal length 718.856 px, baseline 0.537166 m, checksum 8f3a0b12"
std::string calibration_text(const StereoCalibration& calibration) {
  ContentsChecksum checksum;
  add_camera(checksum, calibration.left);
  add_camera(checksum, calibration.right);
  add_pose(checksum, calibration.T_right_left);
  add_pose(checksum, calibration.T_body_left);
  for (const int value : {calibration.width, calibration.height, calibration.rectified ? 1 : 0})
    checksum.add(static_cast<double>(value));
  char text[128];
  if (calibration.mono())
    std::snprintf(text, sizeof text, "focal length %.6g px", calibration.left.fx);
  else
    std::snprintf(text, sizeof text, "focal length %.6g px, baseline %.6g m", calibration.left.fx,
                  calibration.T_right_left.t.norm());
  return text + (", checksum " + hex(checksum.value()));
}

}  // namespace

RecordingIdentity identity_of(const StereoSource& source) {
  ContentsChecksum checksum;
  checksum.add(static_cast<std::int64_t>(source.contents()));
  if (const std::string imu = source.imu(); !source.calibration().mono() && !imu.empty()) add_imu(checksum, imu);
  return {source.fingerprint(), source.count(), checksum.value(), calibration_text(source.calibration())};
}

std::string fingerprint_of_keyframes(const SessionHeader& session) {
  return "keyframes of session " + session.uuid.to_string();
}

Result<KeyframeFileIdentity> identity_of_keyframes(const std::string& path) {
  auto file = KeyframeFileReader::open(path);
  if (!file.ok()) return file.status();
  const auto first = file->next();
  if (!first.ok()) return first.status();
  if (!*first) return {Reason::BAD_SIZE, path + " holds no keyframe"};
  file->rewind();
  ContentsChecksum checksum;
  std::uint64_t count = 0;
  for (;; ++count) {
    const auto beginning = file->skip(kKeyframeBeginning);
    if (!beginning.ok() || !*beginning) break;  // reading the keyframes will report it
    checksum.add(static_cast<std::int64_t>(file->position()));
    checksum.add(**beginning);
  }
  return KeyframeFileIdentity{{fingerprint_of_keyframes((*first)->session), count, checksum.value(), {}},
                              (*first)->session};
}

}  // namespace relmap::capture
