// The settings of a camera besides its video mode: exposure and other features, trigger, strobes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "frontend/capture/iidc/register_file.h"
#include "proto/base/status.h"

namespace relmap::iidc {

// In the order of their registers (FEATURE_HI_INQ, FEATURE_LO_INQ); the last four are in the low half.
enum class Feature : std::uint8_t {
  kBrightness,
  kAutoExposure,
  kSharpness,
  kWhiteBalance,
  kHue,
  kSaturation,
  kGamma,
  kShutter,
  kGain,
  kIris,
  kFocus,
  kTemperature,
  kTrigger,
  kTriggerDelay,
  kWhiteShading,
  kFrameRate,
  kZoom,
  kPan,
  kTilt,
  kOpticalFilter,
};
inline constexpr int kFeatures = 20;

// The name, as in "auto_exposure", and the feature of a name, if there is one.
std::string_view feature_name(Feature feature);
std::optional<Feature> feature_by_name(std::string_view name);
// The unit of absolute values: "s", "dB", "fps", ...; empty if it has none.
std::string_view feature_unit(Feature feature);

struct FeatureState {
  Feature feature{};
  bool can_be_off = false, can_be_auto = false, can_be_set = false, can_once = false;
  std::uint32_t min = 0, max = 0;
  bool absolute = false;  // it has absolute values, in feature_unit()
  float absolute_min = 0, absolute_max = 0;
  // The current state.
  bool on = false, automatic = false, by_absolute = false;
  std::uint32_t value = 0;  // white balance: U/B << 12 | V/R; trigger: source << 4 | mode
  float absolute_value = 0;
};

// Reads all features that the camera has.
Result<std::vector<FeatureState>> read_features(const RegisterFile& registers);
// UNSUPPORTED if the camera does not have the feature.
Result<FeatureState> read_feature(const RegisterFile& registers, Feature feature);

struct FeatureSetting {
  enum class How : std::uint8_t { kTurnOff, kTurnOn, kAuto, kOnce, kValue, kAbsolute };
  Feature feature{};
  How how = How::kValue;
  std::uint32_t value = 0;
  float absolute = 0;

  // Parses "auto", "off", "on", "once" (set automatically now, then kept), "128" (raw), or "abs 0.0125" (in
  // feature_unit()). INVALID_ARGUMENT for any other text, for an unknown name, and for the trigger, which has
  // TriggerSetting.
  static Result<FeatureSetting> parse(std::string_view name, std::string_view text);
};

// Sets a feature and reads it back. UNSUPPORTED if the camera does not have the feature or that mode of it;
// INVALID_ARGUMENT if the value is out of range, which the message states; REGISTER_REFUSED.
Status set_feature(const RegisterFile& registers, const FeatureSetting& setting);

struct TriggerSetting {
  bool on = false;
  int mode = 0;    // 0 .. 15 (TRIGGER_MODE): 0 an edge starts the exposure, 1 the level lasts as long as the exposure
  int source = 0;  // 0 .. 3 pins, 7 software
  bool active_high = false;

  // Parses "off", or "MODE,SOURCE" optionally followed by "high" or "low": "0,7", "0,0,high". INVALID_ARGUMENT.
  static Result<TriggerSetting> parse(std::string_view text);
};
// The reasons of set_feature().
Status set_trigger(const RegisterFile& registers, const TriggerSetting& setting);

struct StrobeSetting {
  int pin = 0;  // 0 .. 3
  bool on = false;
  bool active_high = false;
  std::uint32_t delay = 0, duration = 0;  // raw, 12 bits; a duration of 0 means as long as the exposure

  // Parses "PIN,off" or "PIN,high,DELAY,DURATION". INVALID_ARGUMENT.
  static Result<StrobeSetting> parse(std::string_view text);
};
// The reasons of set_feature().
Status set_strobe(const RegisterFile& registers, const StrobeSetting& setting);

}  // namespace relmap::iidc
