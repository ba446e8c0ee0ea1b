#include "tools/camera/cli.h"

#include <CLI/CLI.hpp>
#include <ostream>

#include "tools/camera/commands.h"
#include "tools/terminal/command_line.h"

namespace relmap::camera {

namespace {

constexpr char kFooter[] = R"(
CAMERA is a serial number or GUID, as `relmap-camera list` prints them; it may be left out if there is only one camera.
show and check also take the file of a recording. Calibrations and settings are kept in a folder by serial number
(docs/cameras.md). Data goes to stdout, everything else to stderr.

Exit codes:
  0  done
  1  failed; the first word on stderr is the reason
  2  wrong usage
  3  check found something wrong
  4  interrupted

Examples:
  relmap-camera list
  relmap-camera info 7140058
  relmap-camera set 7140058 shutter=auto gain=64 "frame_rate=abs 15"
  relmap-camera set trigger=0,7,high              # mode 0, by software
  relmap-camera show --out pictures/ --count 5    # PNG files, both eyes side by side
  relmap-camera check 7140058                     # are rows, eyes and focus as they should be?
  relmap-camera record drive.raw --seconds 600
  relmap-camera replay drive.raw -- --robot cart --server /srv/map
  relmap-frontend --source iidc --robot cart      # tracks a camera live)";

}  // namespace

int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err) {
  CLI::App app("Finds IIDC stereo cameras, sets their features, shows and checks their pictures, and records them.",
               "relmap-camera");
  GlobalOptions options;
  Action action;
  app.footer(kFooter);
  app.require_subcommand(1);
  app.fallthrough();
  terminal::add_standard_options(app);
  app.add_option("--bus", options.bus, "bus on which cameras are looked for")
      ->check(CLI::IsMember({"auto", "usb", "1394"}))
      ->capture_default_str();
  app.add_option("--cameras", options.camera_folder,
                 "folder of calibrations and settings by serial number (default:\n"
                 "$XDG_CONFIG_HOME/relmap/cameras, or ~/.config/relmap/cameras)")
      ->type_name("FOLDER");
  app.add_flag("--json", options.json, "print answers as JSON, one object a line");
  app.add_flag("--quiet", options.quiet, "show no progress");
  for (const auto add : {add_list, add_info, add_set, add_show, add_check, add_record, add_replay}) add(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return terminal::end_with(app, error, out, err, kUsage);
  }
  terminal::Console console(out, err);
  console.json = options.json;
  const auto done = action(options, console);
  if (done.ok()) return *done;
  err << "relmap-camera: " << done.status().to_string() << '\n';
  return done.reason() == Reason::INVALID_ARGUMENT ? kUsage : kFailed;
}

}  // namespace relmap::camera
