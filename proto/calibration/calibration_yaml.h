// What the parsers of calibrations in YAML share. These functions throw where the text is malformed; guarded() turns
// that into a status, so that no exception leaves a parser.
#pragma once

#include <yaml-cpp/yaml.h>

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/base/refuse.h"
#include "proto/calibration/calibration.h"
#include "proto/calibration/calibration_text.h"

namespace relmap::calibration_yaml {

// Thrown by the functions below; guarded() returns its status.
struct Unreadable {
  Status status;
};

template <typename... Parts>
[[noreturn]] void fail(Reason reason, const Parts&... parts) {
  throw Unreadable{refuse(reason, parts...)};
}

// Parses `text`, whose root must be a map of names.
YAML::Node load(std::string_view text);

// The node of the first of `names` that `root` has, or an undefined node.
YAML::Node find(const YAML::Node& root, std::initializer_list<const char*> names);

// Reads min_count to max_count numbers from a list, a list of rows, or the `data` of a matrix. `what` names them in the
// message.
std::vector<double> numbers(const YAML::Node& node, const char* what, std::size_t min_count, std::size_t max_count);

void set_distortion(RawCamera& camera, const std::vector<double>& d, const char* what);  // k1, k2, p1, p2, k3
void set_size(StereoCalibration& calibration, const std::vector<double>& size);          // width, height

// Reads a camera from its matrix of nine numbers and its distortion, which may be undefined.
RawCamera opencv_camera(const YAML::Node& matrix, const YAML::Node& distortion, const char* what);

SE3 rigid(const std::vector<double>& r, const Vector3& t, const char* what);  // nine numbers, row by row
SE3 rigid(const YAML::Node& matrix, const char* what);                        // 4 x 4

// Returns `calibration`, or throws what check_plausible() says of it.
StereoCalibration plausible(StereoCalibration calibration);

// What `read` returns, or the status of the exception that it or yaml-cpp throws.
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
