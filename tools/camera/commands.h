// What the commands of relmap-camera have in common.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "frontend/capture/dc1394/camera_buses.h"
#include "frontend/capture/iidc/iidc_source.h"
#include "proto/base/status.h"
#include "tools/camera/cli.h"
#include "tools/terminal/console.h"

namespace relmap::camera {

struct GlobalOptions {
  std::string bus = "auto";   // usb, 1394
  std::string camera_folder;  // empty: the default one
  bool json = false;
  bool quiet = false;
};

// Exit code or, where something could not be done, why.
using Action = std::function<Result<ExitCode>(const GlobalOptions&, terminal::Console&)>;

void add_list(CLI::App& app, Action& action);
void add_info(CLI::App& app, Action& action);
void add_set(CLI::App& app, Action& action);
void add_show(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_record(CLI::App& app, Action& action);
void add_replay(CLI::App& app, Action& action);

std::string folder_of(const GlobalOptions& options);

// A camera whose registers are read and written; its stream may be another program's.
struct Registers {
  iidc::FoundCamera camera;
  std::unique_ptr<iidc::CameraLink> link;
  iidc::ConfigRom rom;
  iidc::RegisterFile file() const { return {*link, rom.command_registers}; }
};
Result<Registers> open_registers(const GlobalOptions& options, const std::string& serial);

// Raw frames of a camera that streams, or of a log of them, with their layout.
class PairStream {
 public:
  virtual ~PairStream() = default;
  virtual std::string describe() const = 0;
  virtual Result<StereoCalibration> calibration() const = 0;  // NO_CALIBRATION
  // Nothing: the end, or an interrupt. An error is a gap.
  virtual Result<std::optional<capture::StereoFrame>> next() = 0;
};
// `camera`: a serial number, a GUID, empty for the only camera, or a raw log's file.
Result<std::unique_ptr<PairStream>> open_pairs(const GlobalOptions& options, const std::string& camera,
                                               const std::string& calibration, double rate_hz);

// Set by Ctrl-C from the first call on.
const std::atomic<bool>& stop_flag();

}  // namespace relmap::camera
