// What the parsers of calibrations in YAML share: numbers read out of it with care, and exceptions kept inside.
#pragma once

#include <yaml-cpp/yaml.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/calibration/calibration.h"
#include "proto/calibration/calibration_text.h"

namespace relmap::calibration_yaml {

// Thrown by what follows; guarded() answers with its status.
struct Unreadable {
  Status status;
};

template <typename... Parts>
[[noreturn]] void fail(Reason reason, const Parts&... parts) {
  throw Unreadable{refuse_calibration(reason, parts...)};
}

// The map of names that the text is.
YAML::Node load(std::string_view text);

// The first of the names that is there, or an undefined node.
YAML::Node find(const YAML::Node& root, std::initializer_list<const char*> names);

// least..most numbers: a list, a list of rows, or the `data` of a matrix.
std::vector<double> numbers(const YAML::Node& node, const char* what, std::size_t least, std::size_t most);

void set_distortion(RawCamera& camera, const std::vector<double>& d, const char* what);  // k1, k2, p1, p2, k3
void set_size(StereoCalibration& calibration, const std::vector<double>& size);          // width, height

// A camera matrix of nine numbers; the distortion may be undefined.
RawCamera opencv_camera(const YAML::Node& matrix, const YAML::Node& distortion, const char* what);

SE3 rigid(const std::vector<double>& r, const Vector3& t, const char* what);  // nine numbers, row by row
SE3 rigid(const YAML::Node& matrix, const char* what);                        // 4 x 4

StereoCalibration believed(StereoCalibration calibration);

// yaml-cpp reports by exceptions; none leaves a parser.
template <typename Read>
auto guarded(Read read) -> Result<decltype(read())> {
  try {
    return read();
  } catch (const Unreadable& unreadable) {
    return unreadable.status;
  } catch (const std::exception& e) {
    return {Reason::CORRUPT, std::string("no calibration: ") + e.what()};
  }
}

}  // namespace relmap::calibration_yaml
