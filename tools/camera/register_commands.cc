// list, info and set: the commands that need no pictures.
#include <algorithm>
#include <cstdio>

#include "proto/base/json.h"
#include "tools/camera/commands.h"

namespace relmap::camera {

namespace {

using iidc::Feature;
using iidc::FeatureState;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string range_text(const FeatureState& state) {
  if (state.feature == Feature::kTrigger) return "";
  std::string text = std::to_string(state.min) + " .. " + std::to_string(state.max);
  if (state.absolute)
    text += " (" + number(state.absolute_min) + " .. " + number(state.absolute_max) + ' ' +
            std::string(iidc::feature_unit(state.feature)) + ')';
  return text;
}

std::string value_text(const FeatureState& state) {
  if (state.feature == Feature::kTrigger)
    return state.on ? "mode " + std::to_string(state.value & 15) + ", source " + std::to_string(state.value >> 4)
                    : "off";
  if (!state.on && state.can_be_off) return "off";
  std::string text = state.automatic ? "auto, " : "";
  text += std::to_string(state.value);
  if (state.absolute)
    text += " (" + number(state.absolute_value) + ' ' + std::string(iidc::feature_unit(state.feature)) + ')';
  return text;
}

std::string takes_text(const FeatureState& state) {
  std::string text;
  const auto add = [&](bool can, const char* what) {
    if (can) text += (text.empty() ? "" : ", ") + std::string(what);
  };
  add(state.can_be_off, "off");
  add(state.can_be_auto, "auto");
  add(state.can_once, "once");
  if (state.feature == Feature::kTrigger) {
    add(true, "MODE,SOURCE");
  } else {
    add(state.can_be_set, "a number");
    add(state.can_be_set && state.absolute, "abs");
  }
  return text;
}

Json json_of(const FeatureState& state) {
  Json json;
  json.add("feature", iidc::feature_name(state.feature))
      .add("on", state.on)
      .add("auto", state.automatic)
      .add("value", std::uint64_t{state.value})
      .add("least", std::uint64_t{state.min})
      .add("most", std::uint64_t{state.max});
  if (state.absolute)
    json.add("absolute", double{state.absolute_value})
        .add("absolute_least", double{state.absolute_min})
        .add("absolute_most", double{state.absolute_max})
        .add("unit", iidc::feature_unit(state.feature));
  return json;
}

void print_features(const std::vector<FeatureState>& features, terminal::Console& console) {
  std::vector<std::vector<std::string>> rows;
  for (const FeatureState& state : features)
    rows.push_back(
        {std::string(iidc::feature_name(state.feature)), value_text(state), range_text(state), takes_text(state)});
  console.table({"feature", "is", "range", "takes"}, rows);
}

std::string codings_text(const iidc::ModeInfo& mode) {
  std::string text;
  for (const iidc::Coding coding : mode.codings)
    text += (text.empty() ? "" : ", ") + std::string(iidc::coding_name(coding));
  return text;
}

bool two_eyes(const iidc::ModeInfo& mode) {
  return std::any_of(mode.codings.begin(), mode.codings.end(),
                     [](iidc::Coding coding) { return iidc::bits_per_pixel(coding) == 16; });
}

std::string calibration_text(const std::string& folder, const std::string& serial) {
  const auto calibration = capture::camera_calibration(folder, serial);
  if (calibration.ok()) return "yes";
  return calibration.reason() == Reason::NO_CALIBRATION ? "none" : std::string(reason_name(calibration.reason()));
}

Result<ExitCode> list(const GlobalOptions& options, terminal::Console& console) {
  const auto buses = iidc::open_camera_buses(options.bus);
  if (!buses.ok()) return buses.status();
  std::vector<Status> troubles;
  const auto cameras = iidc::find_cameras(*buses, &troubles);
  const std::string folder = folder_of(options);
  std::vector<std::vector<std::string>> rows;
  for (const auto& [camera, bus] : cameras) {
    const std::string state = camera.usable.ok() ? "ready" : camera.usable.to_string();
    const std::string calibration = camera.serial.empty() ? "" : calibration_text(folder, camera.serial);
    if (options.json) {
      Json json;
      json.add("serial", camera.serial)
          .add("guid", iidc::guid_text(camera.guid))
          .add("vendor", camera.vendor)
          .add("model", camera.model)
          .add("bus", camera.bus)
          .add("place", camera.place)
          .add("calibration", calibration)
          .add("state", camera.usable.ok() ? std::string_view("ready") : reason_name(camera.usable.reason()))
          .add("message", camera.usable.message());
      console.reply(json.text());
    }
    rows.push_back({camera.serial, camera.model, camera.vendor, camera.bus, camera.place, calibration, state});
  }
  if (!options.json && !rows.empty())
    console.table({"camera", "model", "vendor", "bus", "place", "calibration", "state"}, rows);
  if (rows.empty()) console.err() << "there is no IIDC camera\n";
  for (const Status& trouble : troubles)
    if (rows.empty() || trouble.reason() != Reason::UNSUPPORTED) console.err() << trouble.message() << '\n';
  return kOk;
}

Result<ExitCode> info(const GlobalOptions& options, terminal::Console& console, const std::string& serial) {
  const auto camera = open_registers(options, serial);
  if (!camera.ok()) return camera.status();
  const iidc::RegisterFile file = camera->file();
  const auto modes = iidc::read_modes(file);
  if (!modes.ok()) return modes.status();
  const auto features = iidc::read_features(file);
  if (!features.ok()) return features.status();
  const iidc::CameraAddress& address = camera->camera.address;
  char registers[24];
  std::snprintf(registers, sizeof registers, "%012llXh",
                static_cast<unsigned long long>(camera->rom.command_registers));
  const std::string version = "IIDC " + std::string(camera->rom.version >= 0x102   ? "1.30 or later"
                                                    : camera->rom.version == 0x101 ? "1.20"
                                                                                   : "1.04");
  const std::string calibration = calibration_text(folder_of(options), address.serial);
  if (options.json) {
    std::vector<Json> mode_list, feature_list;
    for (const iidc::ModeInfo& mode : *modes)
      mode_list.push_back(Json()
                              .add("mode", mode.mode.name())
                              .add("width", std::uint64_t(mode.width))
                              .add("height", std::uint64_t(mode.height))
                              .add("codings", codings_text(mode))
                              .add("two_eyes", two_eyes(mode)));
    for (const FeatureState& state : *features) feature_list.push_back(json_of(state));
    console.reply(Json()
                      .add("serial", address.serial)
                      .add("guid", iidc::guid_text(address.guid))
                      .add("vendor", address.vendor)
                      .add("model", address.model)
                      .add("bus", address.bus)
                      .add("place", address.place)
                      .add("specification", version)
                      .add("calibration", calibration)
                      .add("modes", mode_list)
                      .add("features", feature_list)
                      .text());
    return kOk;
  }
  console.facts({{"camera", address.serial},
                 {"GUID", iidc::guid_text(address.guid)},
                 {"model", address.model},
                 {"vendor", address.vendor},
                 {"bus", address.bus + ", " + address.place},
                 {"specification", version + ", registers from " + registers},
                 {"calibration", calibration + " (" + folder_of(options) + ")"}});
  std::vector<std::vector<std::string>> rows;
  for (const iidc::ModeInfo& mode : *modes) {
    std::string rates;
    for (const double rate : mode.rates_hz) rates += (rates.empty() ? "" : ", ") + number(rate);
    rows.push_back({mode.mode.name(), std::to_string(mode.width) + " x " + std::to_string(mode.height),
                    codings_text(mode), mode.mode.format == 7 ? "as packets allow" : rates,
                    two_eyes(mode) ? "yes" : ""});
  }
  console.out() << '\n';
  console.table({"mode", "size", "codings", "rates", "both eyes"}, rows);
  console.out() << '\n';
  print_features(*features, console);
  return kOk;
}

struct Assignment {
  std::string name, value;
};

Result<ExitCode> set(const GlobalOptions& options, terminal::Console& console, std::vector<std::string> words) {
  std::string serial;
  if (words.front().find('=') == std::string::npos) {
    serial = words.front();
    words.erase(words.begin());
  }
  // All words are parsed before any register is written.
  std::vector<Assignment> assignments;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0)
      return {Reason::INVALID_ARGUMENT, "'" + word + "' is not of the form FEATURE=VALUE"};
    Assignment one{word.substr(0, equals), word.substr(equals + 1)};
    const Status understood = one.name == "trigger"  ? iidc::TriggerSetting::parse(one.value).status()
                              : one.name == "strobe" ? iidc::StrobeSetting::parse(one.value).status()
                                                     : iidc::FeatureSetting::parse(one.name, one.value).status();
    if (!understood.ok()) return understood;
    assignments.push_back(std::move(one));
  }
  if (assignments.empty()) return {Reason::INVALID_ARGUMENT, "nothing to set: give FEATURE=VALUE"};
  const auto camera = open_registers(options, serial);
  if (!camera.ok()) return camera.status();
  const iidc::RegisterFile file = camera->file();
  std::vector<FeatureState> states;
  for (const Assignment& one : assignments) {
    Status status = one.name == "trigger"  ? iidc::set_trigger(file, *iidc::TriggerSetting::parse(one.value))
                    : one.name == "strobe" ? iidc::set_strobe(file, *iidc::StrobeSetting::parse(one.value))
                                           : iidc::set_feature(file, *iidc::FeatureSetting::parse(one.name, one.value));
    if (!status.ok()) return status;
    if (one.name == "strobe") continue;
    const auto state = iidc::read_feature(file, *iidc::feature_by_name(one.name));
    if (!state.ok()) return state.status();
    states.push_back(*state);
  }
  if (options.json)
    for (const FeatureState& state : states) console.reply(json_of(state).text());
  else if (!states.empty())
    print_features(states, console);
  return kOk;
}

}  // namespace

void add_list(CLI::App& app, Action& action) {
  auto* const command = app.add_subcommand("list", "list the cameras that are connected");
  command->footer("Examples:\n  relmap-camera list\n  relmap-camera --json list");
  command->callback([&action] { action = list; });
}

void add_info(CLI::App& app, Action& action) {
  auto* const command = app.add_subcommand("info", "show a camera's identity, modes, features and their values");
  command->footer("Examples:\n  relmap-camera info\n  relmap-camera info 7140058");
  auto serial = std::make_shared<std::string>();
  command->add_option("CAMERA", *serial, "serial number or GUID");
  command->callback([&action, serial] {
    action = [serial](const GlobalOptions& options, terminal::Console& console) {
      return info(options, console, *serial);
    };
  });
}

void add_set(CLI::App& app, Action& action) {
  auto* const command = app.add_subcommand("set", "set features of a camera, and read them back");
  command->footer(
      "Examples:\n"
      "  relmap-camera set 7140058 shutter=auto gain=64 \"frame_rate=abs 15\"\n"
      "  relmap-camera set trigger=0,7,high   # mode 0, by software");
  auto words = std::make_shared<std::vector<std::string>>();
  command
      ->add_option(
          "WORDS", *words,
          "[CAMERA] FEATURE=VALUE...: off, on, auto, once, a raw number, or 'abs NUMBER' in the feature's unit;\n"
          "trigger=MODE,SOURCE[,high|low]; strobe=PIN,high|low,DELAY,DURATION. A camera loses these values when it\n"
          "is switched off; permanent ones are kept in its settings.yaml")
      ->required();
  command->callback([&action, words] {
    action = [words](const GlobalOptions& options, terminal::Console& console) {
      return set(options, console, *words);
    };
  });
}

}  // namespace relmap::camera
