// What can be set at a camera besides its video mode: exposure and its kind, the trigger, strobes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "frontend/capture/iidc/register_file.h"
#include "proto/base/status.h"

namespace relmap::iidc {

// In the order of their registers (FEATURE_HI_INQ, FEATURE_LO_INQ); the last four are of the low half.
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

// "auto_exposure"; by that name, or nothing.
std::string_view feature_name(Feature feature);
std::optional<Feature> feature_by_name(std::string_view name);
// "s", "dB", "fps", ...; empty where it has no unit.
std::string_view feature_unit(Feature feature);

struct FeatureState {
  Feature feature{};
  bool can_be_off = false, can_be_auto = false, can_be_set = false, can_once = false;
  std::uint32_t least = 0, most = 0;
  bool absolute = false;  // has values in units
  float absolute_least = 0, absolute_most = 0;
  // As it is.
  bool on = false, automatic = false, by_absolute = false;
  std::uint32_t value = 0;  // of white balance U/B << 12 | V/R; of the trigger its source << 4 | mode
  float absolute_value = 0;
};

// Those that the camera has.
Result<std::vector<FeatureState>> read_features(const RegisterFile& registers);
// UNSUPPORTED: it has no such feature.
Result<FeatureState> read_feature(const RegisterFile& registers, Feature feature);

struct FeatureSetting {
  enum class How : std::uint8_t { kTurnOff, kTurnOn, kAuto, kOnce, kValue, kAbsolute };
  Feature feature{};
  How how = How::kValue;
  std::uint32_t value = 0;
  float absolute = 0;

  // "auto", "off", "on", "once" (set automatically now, then kept), "128" (raw), "abs 0.0125" (s, dB, ... as
  // feature_unit()). INVALID_ARGUMENT: what is none of them, no such name, or not for the trigger (TriggerSetting).
  static Result<FeatureSetting> parse(std::string_view name, std::string_view text);
};

// Read back. UNSUPPORTED: the camera has not that feature, or cannot do that with it; INVALID_ARGUMENT: beyond its
// range, which the message tells; REGISTER_REFUSED.
Status set_feature(const RegisterFile& registers, const FeatureSetting& setting);

struct TriggerSetting {
  bool on = false;
  int mode = 0;    // 0 edge starts the exposure, 1 level lasts as long as it, ... 15 (TRIGGER_MODE)
  int source = 0;  // 0 .. 3 pins, 7 software
  bool active_high = false;

  // "off", or "MODE,SOURCE" with "high" or "low" behind: "0,7", "0,0,high". INVALID_ARGUMENT.
  static Result<TriggerSetting> parse(std::string_view text);
};
// As set_feature().
Status set_trigger(const RegisterFile& registers, const TriggerSetting& setting);

struct StrobeSetting {
  int pin = 0;  // 0 .. 3
  bool on = false;
  bool active_high = false;
  std::uint32_t delay = 0, duration = 0;  // raw, 12 bits; duration 0: as long as the exposure

  // "PIN,off", "PIN,high,DELAY,DURATION". INVALID_ARGUMENT.
  static Result<StrobeSetting> parse(std::string_view text);
};
// As set_feature().
Status set_strobe(const RegisterFile& registers, const StrobeSetting& setting);

}  // namespace relmap::iidc
