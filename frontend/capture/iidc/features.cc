#include "frontend/capture/iidc/features.h"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "frontend/capture/iidc/registers.h"

namespace relmap::iidc {

namespace {

struct Known {
  const char *name, *register_name, *unit;
};

constexpr std::array<Known, kFeatures> kKnown = {{
    {"brightness", "BRIGHTNESS", "%"},
    {"auto_exposure", "AUTO_EXPOSURE", "EV"},
    {"sharpness", "SHARPNESS", ""},
    {"white_balance", "WHITE_BALANCE", "K"},
    {"hue", "HUE", "deg"},
    {"saturation", "SATURATION", "%"},
    {"gamma", "GAMMA", ""},
    {"shutter", "SHUTTER", "s"},
    {"gain", "GAIN", "dB"},
    {"iris", "IRIS", "F"},
    {"focus", "FOCUS", "m"},
    {"temperature", "TEMPERATURE", "K"},
    {"trigger", "TRIGGER_MODE", ""},
    {"trigger_delay", "TRIGGER_DELAY", "s"},
    {"white_shading", "WHITE_SHADING", ""},
    {"frame_rate", "FRAME_RATE", "fps"},
    {"zoom", "ZOOM", "power"},
    {"pan", "PAN", "deg"},
    {"tilt", "TILT", "deg"},
    {"optical_filter", "OPTICAL_FILTER", ""},
}};
constexpr int kHigh = 16;  // features of the high half

// Offsets of a feature's registers, and the bit of its presence.
struct Place {
  std::uint32_t presence, bit, inquiry, control, absolute;
};

Place place_of(Feature feature) {
  const auto index = static_cast<std::uint32_t>(feature);
  if (index < kHigh)
    return {reg::kFeatureHiInq, kOn >> index, reg::kElementInq + 4 * index, reg::kFeature + 4 * index,
            reg::kAbsoluteCsrInq + 4 * index};
  const std::uint32_t low = index - kHigh;
  return {reg::kFeatureLoInq, kOn >> low, reg::kElementInqLow + 4 * low, reg::kFeatureLow + 4 * low,
          reg::kAbsoluteCsrInqLow + 4 * low};
}

const Known& known(Feature feature) { return kKnown[static_cast<std::size_t>(feature)]; }

Status lacks(Feature feature, const std::string& what) {
  return {Reason::UNSUPPORTED, "the camera has no " + what + ": " + std::string(feature_name(feature))};
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

// All of `text` as a number.
template <typename Number>
std::optional<Number> parsed(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// Removes and returns the text up to the next comma, which is removed, too.
std::string_view next_part(std::string_view& text) {
  const std::size_t comma = text.find(',');
  const std::string_view part = text.substr(0, comma);
  text = comma == std::string_view::npos ? std::string_view() : text.substr(comma + 1);
  return part;
}

bool is_level(std::string_view text) { return text == "high" || text == "low"; }

}  // namespace

std::string_view feature_name(Feature feature) { return known(feature).name; }
std::string_view feature_unit(Feature feature) { return known(feature).unit; }

std::optional<Feature> feature_by_name(std::string_view name) {
  for (std::size_t i = 0; i < kKnown.size(); ++i)
    if (kKnown[i].name == name) return static_cast<Feature>(i);
  return std::nullopt;
}

Result<FeatureState> read_feature(const RegisterFile& registers, Feature feature) {
  const Place place = place_of(feature);
  const auto presence = registers.read(place.presence);
  if (!presence.ok()) return presence.status();
  if (!(*presence & place.bit)) return lacks(feature, "such feature");
  const auto inquired = registers.read(place.inquiry);
  if (!inquired.ok()) return inquired.status();
  if (!(*inquired & inquiry::kPresent)) return lacks(feature, "such feature");
  const auto now = registers.read(place.control);
  if (!now.ok()) return now.status();
  FeatureState state;
  state.feature = feature;
  state.can_be_off = *inquired & inquiry::kOnOff;
  state.can_be_auto = *inquired & inquiry::kAuto;
  state.can_be_set = *inquired & inquiry::kManual;
  state.can_once = *inquired & inquiry::kOnePush;
  // The fields of these features are elsewhere than others', so they can only be read.
  if (feature == Feature::kTemperature || feature == Feature::kWhiteShading)
    state.can_be_set = state.can_be_auto = state.can_once = false;
  state.on = *now & control::kOn;
  if (feature == Feature::kTrigger) {  // its inquiry register lists sources and modes
    state.can_be_set = true;
    state.can_be_auto = state.can_once = false;
    state.value = (*now >> control::kSourceShift & 7) << 4 | (*now >> control::kModeShift & 15);
    return state;
  }
  state.min = *inquired >> inquiry::kMinShift & control::kValue;
  state.max = *inquired & control::kValue;
  state.automatic = *now & control::kAuto;
  state.by_absolute = *now & control::kAbsolute;
  state.value = *now & (feature == Feature::kWhiteBalance ? 0xff'ffffu : control::kValue);
  if (!(*inquired & inquiry::kAbsolute)) return state;
  const auto values = registers.at(place.absolute);
  if (values.reason() == Reason::UNSUPPORTED) return state;
  if (!values.ok()) return values.status();
  for (const auto& [offset, into] : {std::pair{absolute::kMin, &state.absolute_min},
                                     {absolute::kMax, &state.absolute_max},
                                     {absolute::kValue, &state.absolute_value}}) {
    const auto bits = values->read(offset);
    if (!bits.ok()) return bits.status();
    *into = std::bit_cast<float>(*bits);
  }
  state.absolute = std::isfinite(state.absolute_min) && std::isfinite(state.absolute_max);
  return state;
}

Result<std::vector<FeatureState>> read_features(const RegisterFile& registers) {
  std::vector<FeatureState> features;
  for (int i = 0; i < kFeatures; ++i) {
    auto state = read_feature(registers, static_cast<Feature>(i));
    if (state.reason() == Reason::UNSUPPORTED) continue;
    if (!state.ok()) return state.status();
    features.push_back(*state);
  }
  return features;
}

Result<FeatureSetting> FeatureSetting::parse(std::string_view name, std::string_view text) {
  const auto feature = feature_by_name(name);
  if (!feature) {
    std::string names;
    for (const Known& one : kKnown) names += std::string(names.empty() ? "" : ", ") + one.name;
    return {Reason::INVALID_ARGUMENT, "no feature '" + std::string(name) + "'; known: " + names};
  }
  FeatureSetting setting;
  setting.feature = *feature;
  constexpr std::string_view kAbsolute = "abs ";
  if (*feature == Feature::kTrigger)
    return {Reason::INVALID_ARGUMENT, "the trigger takes MODE,SOURCE or off, not as a feature"};
  if (text == "off")
    setting.how = How::kTurnOff;
  else if (text == "on")
    setting.how = How::kTurnOn;
  else if (text == "auto")
    setting.how = How::kAuto;
  else if (text == "once")
    setting.how = How::kOnce;
  else if (const auto value = parsed<std::uint32_t>(text))
    setting.value = *value;
  else if (const auto real = text.starts_with(kAbsolute) ? parsed<float>(text.substr(kAbsolute.size())) : std::nullopt;
           real && std::isfinite(*real))
    setting.how = How::kAbsolute, setting.absolute = *real;
  else
    return {Reason::INVALID_ARGUMENT, std::string(name) + ": '" + std::string(text) +
                                          "' is none of auto, off, on, once, a raw value (128), a value in units (abs "
                                          "0.0125)"};
  return setting;
}

Status set_feature(const RegisterFile& registers, const FeatureSetting& setting) {
  using How = FeatureSetting::How;
  const Feature feature = setting.feature;
  const auto state = read_feature(registers, feature);
  if (!state.ok()) return state.status();
  const Place place = place_of(feature);
  const std::string name = known(feature).register_name;
  const auto write = [&](std::uint32_t bits, std::uint32_t mask) {
    return registers.write_kept(place.control, control::kPresent | bits, mask, name);
  };
  // Bits that have no meaning for this feature may have any value.
  const std::uint32_t off_auto = (state->can_be_off ? control::kOn : 0) | (state->can_be_auto ? control::kAuto : 0);
  switch (setting.how) {
    case How::kTurnOff:
      if (!state->can_be_off) return lacks(feature, "way to switch it off");
      return write(state->value, control::kOn);
    case How::kTurnOn:
      if (!state->can_be_off && !state->on) return lacks(feature, "way to switch it on");
      return write(control::kOn | (state->automatic ? control::kAuto : 0) |
                       (state->by_absolute ? control::kAbsolute : 0) | state->value,
                   off_auto);
    case How::kAuto:
      if (!state->can_be_auto) return lacks(feature, "automatic mode");
      return write(control::kOn | control::kAuto | state->value, off_auto);
    case How::kOnce:  // the camera clears the bit when it is done
      if (!state->can_once) return lacks(feature, "one-push mode");
      return write(control::kOn | control::kOnePush | state->value, off_auto);
    case How::kValue: {
      if (!state->can_be_set) return lacks(feature, "manual mode");
      const bool pair = feature == Feature::kWhiteBalance;
      const std::uint32_t high = pair ? setting.value >> 12 : setting.value, low = setting.value & control::kValue;
      if (high < state->min || high > state->max || (pair && (low < state->min || low > state->max)))
        return {Reason::INVALID_ARGUMENT, std::string(feature_name(feature)) + " takes " + std::to_string(state->min) +
                                              " .. " + std::to_string(state->max) + ", not " +
                                              std::to_string(setting.value)};
      return write(control::kOn | setting.value, off_auto | control::kAbsolute | (pair ? 0xff'ffffu : control::kValue));
    }
    case How::kAbsolute: {
      if (!state->absolute || !state->can_be_set) return lacks(feature, "value in units");
      if (setting.absolute < state->absolute_min || setting.absolute > state->absolute_max)
        return {Reason::INVALID_ARGUMENT, std::string(feature_name(feature)) + " takes " + number(state->absolute_min) +
                                              " .. " + number(state->absolute_max) + ' ' + known(feature).unit +
                                              ", not " + number(setting.absolute)};
      if (Status status = write(control::kOn | control::kAbsolute | state->value, off_auto | control::kAbsolute);
          !status.ok())
        return status;
      const auto values = registers.at(place.absolute);
      if (!values.ok()) return values.status();
      if (Status status = values->write(absolute::kValue, std::bit_cast<std::uint32_t>(setting.absolute)); !status.ok())
        return status;
      const auto kept = values->read(absolute::kValue);
      if (!kept.ok()) return kept.status();
      // A sensor has discrete steps: tolerate a hundredth, or one step of the raw values.
      const float got = std::bit_cast<float>(*kept), range = state->absolute_max - state->absolute_min;
      const float step = range / static_cast<float>(std::max(1u, state->max - state->min));
      if (!(std::abs(got - setting.absolute) <= std::max(step, 0.01f * std::abs(setting.absolute))))
        return {Reason::REGISTER_REFUSED,
                name + " holds " + number(got) + " after " + number(setting.absolute) + " was written"};
      return {};
    }
  }
  return {};
}

Result<TriggerSetting> TriggerSetting::parse(std::string_view text) {
  const Status wrong(Reason::INVALID_ARGUMENT,
                     "'" + std::string(text) + "' is no trigger: off, or MODE,SOURCE (0,7), with high or low behind");
  TriggerSetting setting;
  if (text == "off") return setting;
  setting.on = true;
  const auto mode = parsed<int>(next_part(text)), source = parsed<int>(next_part(text));
  if (!mode || !source || *mode < 0 || *mode > 15 || *source < 0 || *source > 7) return wrong;
  if (!text.empty() && !is_level(text)) return wrong;
  setting.mode = *mode;
  setting.source = *source;
  setting.active_high = text == "high";
  return setting;
}

Status set_trigger(const RegisterFile& registers, const TriggerSetting& setting) {
  const auto state = read_feature(registers, Feature::kTrigger);
  if (!state.ok()) return state.status();
  const Place place = place_of(Feature::kTrigger);
  const auto inquired = registers.read(place.inquiry), now = registers.read(place.control);
  if (!inquired.ok()) return inquired.status();
  if (!now.ok()) return now.status();
  const std::uint32_t polarity = *inquired & inquiry::kAuto ? control::kPolarity : 0;  // there: Polarity_Inq
  const std::uint32_t fields = control::kOn | polarity | 7u << control::kSourceShift | 15u << control::kModeShift;
  const std::uint32_t bits = (setting.on ? control::kOn : 0) | (setting.active_high ? control::kPolarity : 0) |
                             static_cast<std::uint32_t>(setting.source) << control::kSourceShift |
                             static_cast<std::uint32_t>(setting.mode) << control::kModeShift |
                             (*now & control::kValue);  // its parameter stays
  return registers.write_kept(place.control, control::kPresent | bits, setting.on ? fields : control::kOn,
                              "TRIGGER_MODE");
}

Result<StrobeSetting> StrobeSetting::parse(std::string_view text) {
  const Status wrong(Reason::INVALID_ARGUMENT, "'" + std::string(text) +
                                                   "' is no strobe: PIN,off, or PIN,high,DELAY,DURATION (low: active "
                                                   "low)");
  StrobeSetting setting;
  const auto pin = parsed<int>(next_part(text));
  if (!pin || *pin < 0 || *pin > 3) return wrong;
  setting.pin = *pin;
  if (text == "off") return setting;
  const std::string_view level = next_part(text);
  const auto delay = parsed<std::uint32_t>(next_part(text)), duration = parsed<std::uint32_t>(next_part(text));
  if (!is_level(level) || !delay || !duration || *delay > control::kValue || *duration > control::kValue ||
      !text.empty())
    return wrong;
  setting.on = true;
  setting.active_high = level == "high";
  setting.delay = *delay;
  setting.duration = *duration;
  return setting;
}

Status set_strobe(const RegisterFile& registers, const StrobeSetting& setting) {
  const auto pin = static_cast<std::uint32_t>(setting.pin);
  const auto strobes = registers.at(reg::kStrobeCsrInq);
  if (strobes.reason() == Reason::UNSUPPORTED) return {Reason::UNSUPPORTED, "the camera has no strobes"};
  if (!strobes.ok()) return strobes.status();
  const auto present = strobes->read(strobe::kPresence);
  if (!present.ok()) return present.status();
  if (!(*present & kOn >> pin)) return {Reason::UNSUPPORTED, "the camera has no strobe " + std::to_string(pin)};
  const std::uint32_t bits = (setting.on ? control::kOn : 0) | (setting.active_high ? control::kPolarity : 0) |
                             setting.delay << 12 | setting.duration;
  return strobes->write_kept(strobe::kControl + 4 * pin, control::kPresent | bits,
                             setting.on ? 0x03ff'ffffu : control::kOn, "STROBE_" + std::to_string(pin) + "_CNT");
}

}  // namespace relmap::iidc
