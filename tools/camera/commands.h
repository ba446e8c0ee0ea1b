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
  std::string camera_folder;  // empty: the default folder
  bool json = false;
  bool quiet = false;
};

// The work of a command. Returns the exit code, or why the command failed.
using Action = std::function<Result<ExitCode>(const GlobalOptions&, terminal::Console&)>;

void add_list(CLI::App& app, Action& action);
void add_info(CLI::App& app, Action& action);
void add_set(CLI::App& app, Action& action);
void add_show(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_record(CLI::App& app, Action& action);
void add_replay(CLI::App& app, Action& action);

std::string folder_of(const GlobalOptions& options);

// A camera whose registers can be read and written, even while another program has its stream.
struct Registers {
  iidc::FoundCamera camera;
  std::unique_ptr<iidc::CameraLink> link;
  iidc::ConfigRom rom;
  iidc::RegisterFile file() const { return {*link, rom.command_registers}; }
};
Result<Registers> open_registers(const GlobalOptions& options, const std::string& serial);

// The stereo pairs of a live camera, or of a log of raw frames.
class PairStream {
 public:
  virtual ~PairStream() = default;
  virtual std::string describe() const = 0;
  virtual Result<StereoCalibration> calibration() const = 0;  // NO_CALIBRATION
  // The next pair; nullopt at the end or after an interrupt. An error is a gap: the stream goes on.
  virtual Result<std::optional<capture::StereoFrame>> next() = 0;
};
// `camera`: a serial number, a GUID, the file of a raw log, or empty for the only camera.
Result<std::unique_ptr<PairStream>> open_pairs(const GlobalOptions& options, const std::string& camera,
                                               const std::string& calibration, double rate_hz);

// Set by the first SIGINT or SIGTERM after the first call; the second one ends the program.
const std::atomic<bool>& stop_flag();

}  // namespace relmap::camera
