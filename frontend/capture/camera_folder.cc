#include "frontend/capture/camera_folder.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "frontend/capture/text_file.h"

namespace relmap::capture {

namespace fs = std::filesystem;

namespace {

constexpr const char* kFeatureValues = "auto, off, on, once, a raw value of 0..16777215, or one in units: abs 0.0125";

// Thrown inside this file only.
struct BadConfig {
  std::string message;
};

[[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& allowed) {
  throw BadConfig{key + ": '" + value + "'; allowed: " + allowed};
}

std::string scalar(const YAML::Node& node, const std::string& key, const char* allowed) {
  if (!node.IsScalar()) refuse(key, node.IsNull() ? "" : "a list or map", allowed);
  return node.Scalar();
}

template <typename Number>
bool read_number(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

template <typename Value>
Value one_of(const YAML::Node& node, const std::string& key,
             std::initializer_list<std::pair<const char*, Value>> values) {
  std::string allowed;
  for (const auto& [name, value] : values) allowed += (allowed.empty() ? "" : ", ") + std::string(name);
  const std::string given = scalar(node, key, allowed.c_str());
  for (const auto& [name, value] : values)
    if (given == name) return value;
  refuse(key, given, allowed);
}

std::string read_mode(const YAML::Node& node) {
  constexpr const char* kAllowed = "formatF.M, as format7.3, of formats and modes 0..7";
  const std::string mode = scalar(node, "mode", kAllowed);
  const auto digit = [&](std::size_t at) { return mode[at] >= '0' && mode[at] <= '7'; };
  if (mode.size() != 9 || !mode.starts_with("format") || !digit(6) || mode[7] != '.' || !digit(8))
    refuse("mode", mode, kAllowed);
  return mode;
}

double read_rate(const YAML::Node& node) {
  constexpr const char* kAllowed = "0.1..240 frames a second";
  const std::string text = scalar(node, "rate_hz", kAllowed);
  double rate = 0;
  if (!read_number(text, rate) || !(rate >= 0.1 && rate <= 240)) refuse("rate_hz", text, kAllowed);
  return rate;
}

std::string read_feature(const YAML::Node& node, const std::string& key) {
  const std::string value = scalar(node, key, kFeatureValues);
  for (const char* word : {"auto", "off", "on", "once"})
    if (value == word) return value;
  std::uint32_t raw = 0;
  if (read_number(value, raw) && raw < (1U << 24)) return value;
  double units = 0;
  if (value.starts_with("abs ") && read_number(std::string_view(value).substr(4), units) && std::isfinite(units))
    return value;
  refuse(key, value, kFeatureValues);
}

std::vector<std::pair<std::string, std::string>> read_features(const YAML::Node& node) {
  if (!node.IsMap()) refuse("features", "", "names with values, as {shutter: auto, gain: 12}");
  std::vector<std::pair<std::string, std::string>> features;
  for (const auto& entry : node) {
    const std::string name = scalar(entry.first, "features", "names with values, as {shutter: auto, gain: 12}");
    const auto same = [&](const auto& feature) { return feature.first == name; };
    if (std::any_of(features.begin(), features.end(), same)) refuse("features." + name, "twice", "once");
    // The form of these two is checked by the camera's driver (iidc/features.h).
    if (name == "trigger" || name == "strobe")
      features.emplace_back(name, scalar(entry.second, "features." + name,
                                         "off, MODE,SOURCE (trigger); PIN,off, PIN,high,DELAY,DURATION (strobe)"));
    else
      features.emplace_back(name, read_feature(entry.second, "features." + name));
  }
  return features;
}

CameraSettings read_settings(const YAML::Node& root) {
  CameraSettings settings;
  if (root.IsNull()) return settings;
  if (!root.IsMap()) throw BadConfig{"no map of names"};
  for (const auto& entry : root) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
    if (key == "mode") {
      settings.mode = read_mode(entry.second);
    } else if (key == "rate_hz") {
      settings.rate_hz = read_rate(entry.second);
    } else if (key == "first_byte") {
      settings.first_byte =
          one_of<FirstByte>(entry.second, key, {{"left", FirstByte::kLeft}, {"right", FirstByte::kRight}});
    } else if (key == "filter") {
      settings.filter = one_of<ColourFilter>(entry.second, key,
                                             {{"none", ColourFilter::kNone},
                                              {"RGGB", ColourFilter::kRGGB},
                                              {"GBRG", ColourFilter::kGBRG},
                                              {"GRBG", ColourFilter::kGRBG},
                                              {"BGGR", ColourFilter::kBGGR}});
    } else if (key == "features") {
      settings.features = read_features(entry.second);
    } else {
      throw BadConfig{"no such key: '" + key + "'; allowed: mode, rate_hz, first_byte, filter, features"};
    }
  }
  return settings;
}

}  // namespace

Result<CameraSettings> parse_camera_settings(std::string_view text) {
  try {
    return read_settings(YAML::Load(std::string(text)));
  } catch (const BadConfig& bad) {
    return {Reason::BAD_CONFIG, bad.message};
  } catch (const std::exception& e) {  // yaml-cpp's
    return {Reason::BAD_CONFIG, e.what()};
  }
}

std::string default_camera_folder() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  const std::string base = config && *config ? config : std::string(home && *home ? home : ".") + "/.config";
  return base + "/relmap/cameras";
}

Result<StereoCalibration> camera_calibration(const std::string& folder, const std::string& serial) {
  const fs::path own = fs::path(folder) / serial;
  std::string missing = "there is no folder " + own.string();
  std::error_code error;
  if (fs::is_directory(own, error)) {
    auto calibration = load_calibration(own.string());
    if (calibration.ok() || calibration.reason() != Reason::NO_SUCH_FILE) return calibration;
    missing = calibration.status().message();
  }
  for (const char* extension : {".yaml", ".yml", ".txt"})
    if (const std::string file = own.string() + extension; fs::exists(file, error)) return load_calibration(file);
  return {Reason::NO_CALIBRATION, "camera " + serial + ": " + missing + ", nor " + own.string() +
                                      ".yaml, .yml or .txt; put there what OpenCV, kalibr or ROS wrote when they "
                                      "calibrated it, or KITTI's or EuRoC's file (docs/cameras.md, Calibration)"};
}

Result<CameraSettings> camera_settings(const std::string& folder, const std::string& serial) {
  const fs::path file = fs::path(folder) / serial / "settings.yaml";
  std::error_code error;
  if (!fs::exists(file, error)) return CameraSettings{};
  const auto text = read_text_file(file);
  if (!text.ok()) return {Reason::IO_ERROR, text.status().message()};
  auto settings = parse_camera_settings(*text);
  if (!settings.ok()) return {settings.reason(), file.string() + ": " + settings.status().message()};
  return settings;
}

}  // namespace relmap::capture
