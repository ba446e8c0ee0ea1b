#include <charconv>
#include <optional>
#include <vector>

#include "proto/base/refuse.h"
#include "proto/calibration/calibration.h"
#include "proto/calibration/calibration_text.h"

namespace relmap {

namespace {

std::string_view next_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
}

// The numbers on the line that begins with "key:". nullopt: there is no such line; empty: not all of it is numbers, or
// there are more than 16.
std::optional<std::vector<double>> numbers_of(std::string_view text, std::string_view key) {
  while (!text.empty()) {
    std::string_view line = next_line(text);
    if (!line.starts_with(key) || line.substr(key.size(), 1) != ":") continue;
    line.remove_prefix(key.size() + 1);
    std::vector<double> numbers;
    while (true) {
      const std::size_t begin = line.find_first_not_of(" \t\r");
      if (begin == std::string_view::npos) return numbers;
      line.remove_prefix(begin);
      double number = 0;
      const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
      if (error != std::errc{} || numbers.size() == 16) return std::vector<double>();
      numbers.push_back(number);
      line.remove_prefix(static_cast<std::size_t>(end - line.data()));
    }
  }
  return std::nullopt;
}

// CORRUPT unless `p` is a 3x4 projection matrix of a rectified camera, [f 0 cx tx; 0 f cy 0; 0 0 1 0].
Status check_projection(const std::vector<double>& p, std::string_view key) {
  if (p.size() != 12) return refuse(Reason::CORRUPT, key, " is not 12 numbers");
  for (const std::size_t zero : {1u, 4u, 8u, 9u})
    if (p[zero] != 0) return refuse(Reason::CORRUPT, key, " is no rectified projection");
  if (p[10] != 1) return refuse(Reason::CORRUPT, key, " is no rectified projection");
  return {};
}

}  // namespace

Result<StereoCalibration> parse_kitti_calibration(std::string_view text) {
  if (text.size() > kMaxCalibrationBytes) return {Reason::CORRUPT, "too long for a calibration"};
  std::string_view left_key = "P0", right_key = "P1";
  auto p0 = numbers_of(text, left_key);
  if (!p0) p0 = numbers_of(text, left_key = "P_rect_00"), right_key = "P_rect_01";
  if (!p0) return {Reason::CORRUPT, "neither P0 nor P_rect_00 in a KITTI calibration"};
  if (Status s = check_projection(*p0, left_key); !s.ok()) return s;

  StereoCalibration calibration;
  calibration.rectified = true;
  calibration.left = {(*p0)[0], (*p0)[5], (*p0)[2], (*p0)[6]};
  if (const auto p1 = numbers_of(text, right_key)) {
    if (Status s = check_projection(*p1, right_key); !s.ok()) return s;
    calibration.right = {(*p1)[0], (*p1)[5], (*p1)[2], (*p1)[6]};
    calibration.T_right_left.t.x() = ((*p1)[3] - (*p0)[3]) / (*p0)[0];
  }
  if (const auto size = numbers_of(text, "S_rect_00")) {
    if (size->size() != 2 || !((*size)[0] >= 16 && (*size)[0] <= 16384 && (*size)[1] >= 16 && (*size)[1] <= 16384))
      return {Reason::IMPLAUSIBLE_CALIBRATION,
              "S_rect_00 is not the size of a picture; both sides must be 16..16384 px"};
    calibration.width = static_cast<int>((*size)[0]);
    calibration.height = static_cast<int>((*size)[1]);
  }
  if (Status s = calibration.check_plausible(); !s.ok()) return s;
  return calibration;
}

}  // namespace relmap
