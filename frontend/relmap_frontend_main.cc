// relmap-frontend: turns stereo pictures into keyframes and publishes them.
#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>

#include "frontend/console.h"
#include "frontend/tracking/keyframe_pictures.h"
#include "frontend/workflow/exit_code.h"
#include "frontend/workflow/list_recording.h"
#include "frontend/workflow/run_frontend.h"
#include "frontend/workflow/run_options.h"
#include "frontend/workflow/wire/wire_outside.h"
#include "tools/terminal/command_line.h"

namespace relmap::frontend {
namespace {

using namespace workflow;

std::atomic<bool> g_stop = false;
void on_signal(int) { g_stop = true; }

constexpr const char* kFooter =
    "Examples:\n"
    "  relmap-frontend ~/kitti/06 --robot car --lcm 'udpm://239.255.76.67:7667?ttl=0'\n"
    "  relmap-frontend --source euroc ~/euroc/V1_01 --robot drone --session morning --imu auto\n"
    "  relmap-frontend --source images pairs/ --calibration stereo.yaml --robot cart --rate 10\n"
    "  relmap-frontend drive/ --robot cart --to grpc --server /srv/map\n"
    "  relmap-frontend drive/ --robot cart --server map.lab:50070 --spool none \\\n"
    "      --uuid 7a0c1f52-5f0e-4c7d-9d43-0a8f6b1f2e11 --progress json\n"
    "  relmap-frontend --source sim drive/ --robot sim --out keyframes.bin\n"
    "  relmap-frontend drive/ --robot sim --out k.bin --report pairs.tsv --show tracks.mp4\n"
    "  relmap-frontend --source images --mono photos/ --robot phone --session tower\n"
    "  relmap-frontend --source log lcmlog-2026-11-21.00 --recorded morning --out k.bin\n"
    "  relmap-frontend --source iidc --robot cart --server map.lab:50070 --credentials cart.pem\n"
    "  relmap-frontend --source iidc --robot cart --lcm 'udpm://239.255.76.67:7667?ttl=1' --credentials cart.pem\n"
    "  relmap-frontend --source iidc 7140058 --rate 15 --robot cart --session morning\n"
    "  relmap-frontend --source raw drive.raw --robot cart --server /srv/map\n"
    "\n"
    "Sources:\n"
    "  kitti   image_0, image_1, calib.txt, times.txt\n"
    "  euroc   mav0/, or cam0 and cam1\n"
    "  images  left and right, cam0 and cam1, ...; with --calibration or one in the folder\n"
    "  sim     a folder written by relmap-sim: pictures, or keyframes.bin\n"
    "  log     keyframes that lcm-logger recorded\n"
    "  raw     what relmap-camera recorded\n"
    "  iidc    a live stereo camera (relmap-camera list); always --live, until Ctrl-C\n"
    "  auto    the one of the others, except iidc, that the folder or file looks like\n"
    "\n"
    "A camera of one eye is refused, since it cannot measure metres. With --mono its pictures make a mono session,\n"
    "whose frames can be recognised (relmap match) but have no edges; it needs no calibration.\n"
    "\n"
    "Keyframes that relmapd has not settled stay in the spool; the same command continues where it stopped. With\n"
    "--spool none and a --uuid, repeating the command after an interruption starts the recording over: it gives the\n"
    "same keyframes, and those that relmapd has are not sent again.\n"
    "\n"
    "--progress json prints {\"pairs\", \"of\", \"keyframes\", \"settled\", \"path_m\", \"trouble\"} four times a\n"
    "second. --report writes a tab-separated line for each pair (or picture), and a summary in comment lines. --show\n"
    "draws the tracks on the left pictures.\n"
    "\n"
    "Exit codes:\n"
    "  0  everything settled\n"
    "  1  failed; the reason is printed\n"
    "  2  wrong usage; also a session that belongs to another recording\n"
    "  3  keyframes left unsettled, refused, or given up (gaps in the map)\n"
    "  4  interrupted\n"
    "  5  done, but not to be trusted: fewer than 80 % of the expected pairs were measured, or the eyes are not as\n"
    "     the calibration says (the summary begins with it)\n"
    "\n"
    "1, 2 and 4 take precedence over 3, and 3 over 5. If the eyes are plainly wrong in the first pairs (NOT_STEREO,\n"
    "ROWS_APART, EYE_DEAD), a recording ends with 1 before a session begins; a live camera continues with a warning.";

int main_function(int argc, char** argv) {
  RunOptions a;
  std::string map, rate = "max", picture_kind = "whole", progress = "text";
  bool json = false;
  CLI::App app("Turns stereo pictures into keyframes of a relative map and publishes them.", "relmap-frontend");
  app.footer(kFooter);
  terminal::add_standard_options(app);
  app.add_option("--source", a.source, "where pairs come from")
      ->check(CLI::IsMember({"kitti", "euroc", "images", "sim", "raw", "log", "iidc", "auto"}))
      ->capture_default_str();
  app.add_option("path", a.path,
                 "the source's folder or file; with iidc the camera's serial number, which is optional if there is "
                 "only one")
      ->type_name("FILE|FOLDER");
  app.add_option("--robot", a.robot, "name of the robot; required, except for recorded keyframes")->type_name("NAME");
  app.add_option("--session", a.session, "name of the session (default: the folder's name, or as recorded)")
      ->type_name("NAME");
  auto* const recorded =
      app.add_option("--recorded", a.recorded, "which session of a log, by its uuid or name (default: the only one)")
          ->type_name("SESSION");
  bool list = false;
  app.add_flag("--list", list,
               "only print what a recording is, one JSON object a line: what identifies it, the sessions of a log,\n"
               "with --mono the cameras of a folder of pictures")
      ->excludes(recorded);
  auto* const uuid =
      app.add_option("--uuid", a.uuid, "identity of a new session (default: random)")
          ->type_name("UUID")
          ->check([](const std::string& text) { return SessionUuid::parse(text) ? "" : "not a uuid: " + text; });
  app.add_flag("--as-recorded", a.as_recorded,
               "keep the identity of a log's session: keyframes that the map already has are not added again")
      ->excludes(uuid);
  app.add_option("--calibration", a.calibration, "KITTI, OpenCV, EuRoC, kalibr or ROS file, or a folder with one")
      ->type_name("FILE|FOLDER");
  app.add_option("--cameras", a.camera_folder,
                 "folder of calibrations and settings by the cameras' serial numbers (default:\n"
                 "~/.config/relmap/cameras; $XDG_CONFIG_HOME moves it)")
      ->type_name("FOLDER");
  app.add_option("--bus", a.bus, "where cameras are looked for")
      ->check(CLI::IsMember({"auto", "usb", "1394"}))
      ->capture_default_str();
  auto* const imu =
      app.add_option("--imu", a.imu, "recording of an inertial unit: a file or folder, auto (the data set's), or none")
          ->type_name("FILE|FOLDER|WORD")
          ->capture_default_str();
  auto* const to =
      app.add_option("--to", a.to,
                     "where keyframes go: to relmapd over lcm or grpc, or into a file (default: grpc with\n"
                     "--server, file with --out, else lcm)")
          ->check(CLI::IsMember({"lcm", "grpc", "file"}));
  auto* const lcm = app.add_option("--lcm", a.publisher.lcm_url, "LCM URL")->type_name("URL")->capture_default_str();
  auto* const server =
      app.add_option("--server", a.server, "where relmapd answers over gRPC: its data folder, or HOST:PORT")
          ->type_name("FOLDER|HOST:PORT")
          ->excludes(lcm);
  app.add_option("--credentials", a.credentials,
                 "file that proves which robot this is, over TLS and over LCM (relmap-admin credentials makes it)")
      ->type_name("FILE")
      ->envname("RELMAP_CREDENTIALS");
  app.add_option("--map", map,
                 "UUID of the map into which to send, and no other (relmap status shows it; default: that of the\n"
                 "relmapd that answers first, and then always that one)")
      ->type_name("UUID");
  auto* const spool = app.add_option("--spool", a.publisher.spool,
                                     "folder that keeps keyframes until they are settled (default:\n"
                                     "~/.local/state/relmap/spool/ROBOT.SESSION; $XDG_STATE_HOME moves it); none "
                                     "keeps\nthem in memory, for sources that can be read again")
                          ->type_name("FOLDER");
  auto* const spool_bytes =
      app.add_option("--spool-bytes", a.publisher.spool_bytes, "maximum size of the unsettled keyframes; at least 1MB")
          ->transform(CLI::AsSizeValue(false))
          ->capture_default_str();
  app.add_option("--out", a.out, "the file to write instead of sending: FILE.part until it is complete")
      ->type_name("FILE")
      ->excludes(lcm, server, spool, spool_bytes);
  app.add_flag("--wait", a.wait, "wait for a camera that is not there yet or not available");
  app.add_option("--rate", rate, "pairs a second, or max (for a camera, the rate in its settings or else its maximum)")
      ->type_name("RATE")
      ->capture_default_str();
  app.add_option("--every", a.every, "use every n-th pair")->check(CLI::Range(1, 1000))->capture_default_str();
  auto* const all_keyframes =
      app.add_flag("--all-keyframes", a.all_keyframes, "make each pair a keyframe, for recordings of keyframes");
  auto* const picture =
      app.add_option(
             "--picture", picture_kind,
             "picture of the left eye in each keyframe: whole (up to 32 kB; the map finds its landmarks in it),\n"
             "small (a thumbnail) or none")
          ->check(CLI::IsMember({"whole", "small", "none"}))
          ->capture_default_str();
  app.add_option("--patience", a.patience_s, "seconds without progress before giving up on a silent daemon")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  app.add_option("--report", a.report, "file for the figures of every pair")->type_name("FILE");
  auto* const show =
      app.add_option("--show", a.show, "folder for PNG pictures of the tracks, or an .mp4")->type_name("FILE|FOLDER");
  auto* const live =
      app.add_flag("--live", a.live, "treat the source as a camera, which cannot wait: excess pairs are dropped");
  auto* const oneway = app.add_flag("--oneway", a.oneway, "the session may be travelled only in the direction driven");
  auto* const despite_check =
      app.add_flag("--despite-check", a.despite_check,
                   "track a recording although its first pairs show that the eyes are wrong; ends with 5");
  auto* const mono =
      app.add_flag("--mono", a.mono, "make a mono session of a camera's pictures (source images), without metres");
  app.add_option("--camera", a.camera,
                 "with --mono: whose pictures to use, if a folder has those of several cameras (--list)")
      ->needs(mono);
  mono->excludes(despite_check, imu, recorded, show, live, oneway, all_keyframes, picture);
  app.add_flag("--json", json, "print the summary as JSON on standard output");
  app.add_option("--progress", progress,
                 "text on standard error, or json on standard output, with the summary as JSON at the end")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  app.add_flag("--quiet", a.quiet, "print no progress as text");
  try {
    app.parse(argc, argv);
    if (rate != "max") {
      if (!CLI::detail::lexical_cast(rate, a.rate_hz) || !(a.rate_hz > 0))
        throw CLI::ValidationError("--rate", "neither a number of pairs a second nor max: " + rate);
    }
    if (picture_kind != "whole")
      a.picture = picture_kind == "small" ? tracking::KeyframePicture::kSmall : tracking::KeyframePicture::kNone;
    if (a.mono && a.source != "images" && a.source != "auto")
      throw CLI::ValidationError("--mono", "takes --source images, not " + a.source);
    if (a.path.empty() && a.source != "iidc") throw CLI::RequiredError("path");
    a.live |= a.source == "iidc";
    if (to->count() == 0) a.to = !a.out.empty() ? "file" : !a.server.empty() ? "grpc" : "lcm";
    if ((a.to == "file") == a.out.empty())
      throw CLI::ValidationError("--out", a.out.empty() ? "--to file needs it" : "--to " + a.to + " writes no file");
    if ((a.to == "grpc") == a.server.empty())
      throw CLI::ValidationError("--server", a.server.empty() ? "--to grpc needs it" : "--to " + a.to + " needs none");
    a.publisher.in_memory = a.publisher.spool == "none";
    if (!map.empty()) {
      const auto only = Uuid::parse(map);
      if (!only) throw CLI::ValidationError("--map", "no UUID: " + map);
      a.publisher.map = *only;
    }
    a.progress_json = progress == "json";
    json |= a.progress_json;
  } catch (const CLI::ParseError& error) {
    return terminal::end_with(app, error, std::cout, std::cerr, kUsage);
  }
  const Outside outside = wire_outside();
  if (list) {
    const Status listed = list_recording(a, outside);
    if (!listed.ok()) std::fprintf(stderr, "relmap-frontend: %s\n", listed.to_string().c_str());
    return listed.ok() ? kDone : kFailed;
  }
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);

  RunSummary summary;
  const Status status = run_frontend(a, outside, g_stop, summary);
  if (!status.ok()) std::fprintf(stderr, "relmap-frontend: %s\n", status.to_string().c_str());
  if (json)
    std::printf("%s\n", summary_json(summary).c_str());
  else if (status.ok() || summary.pairs > 0)
    std::fputs(summary_text(summary).c_str(), stdout);
  return exit_code_of(status, summary);
}

}  // namespace
}  // namespace relmap::frontend

int main(int argc, char** argv) {
  setenv("GRPC_VERBOSITY", "NONE", 0);  // what it says of handshakes that fail, the program says in its own words
  try {
    return relmap::frontend::main_function(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "relmap-frontend: %s\n", error.what());
    return relmap::workflow::kFailed;
  }
}
