// relmap-simulated-camera runs a program with a simulated camera, and reports what the camera sent and how much
// processor time the program took. It is a program of its own, since umockdev's library must be loaded before any other
// and does not work together with jemalloc.
#include <signal.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <exception>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "proto/base/json.h"
#include "tests/camera/shown_drive.h"
#include "tests/camera/simulated_camera.h"
#include "tests/camera/under_mock.h"
#include "tests/camera/usb_testbed.h"
#include "tests/support/process.h"
#include "tools/terminal/command_line.h"

namespace relmap::testing {
namespace {

struct Options {
  std::string drive, output, errors, report;
  double rate = 20;
  std::uint64_t pairs = 0;
  std::vector<std::string> command;
};

double processor_seconds_of_children() {
  rusage usage{};
  ::getrusage(RUSAGE_CHILDREN, &usage);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return s(usage.ru_utime) + s(usage.ru_stime);
}

int run(const Options& options) {
  std::optional<ShownDrive> drive;
  if (!options.drive.empty()) drive.emplace(options.drive);
  SimulatedCameraOptions shown = drive ? drive->shuttling_camera(options.rate) : SimulatedCameraOptions();
  shown.rate = options.rate;
  UsbTestbed testbed;
  const auto camera = std::make_shared<SimulatedCamera>(std::move(shown));
  testbed.plug(camera);
  Process process(options.command, {options.output, options.errors});
  std::optional<int> exit_code;
  while (!(exit_code = process.wait(std::chrono::milliseconds(20))))
    if (options.pairs > 0 && testbed.counters(camera).frames >= options.pairs) break;
  if (!exit_code) {
    process.signal(SIGINT);
    exit_code = process.wait(std::chrono::minutes(1));
    if (!exit_code) throw std::runtime_error(options.command.front() + " does not end");
  }
  const UsbCounters sent = testbed.counters(camera);
  std::ofstream out(options.report);
  out << Json()
             .add("exit_code", *exit_code)
             .add("frames", sent.frames)
             .add("lost", sent.lost + sent.cut)
             .add("cpu_s", processor_seconds_of_children())
             .text_lines();
  return out.flush() ? 0 : 1;
}

}  // namespace
}  // namespace relmap::testing

int main(int argc, char** argv) {
  CLI::App app("Runs a program with a simulated IIDC stereo camera.", "relmap-simulated-camera");
  relmap::testing::Options options;
  app.add_option("--drive", options.drive,
                 "Folder of relmap-sim whose pictures are shown, back and forth (default: a moving texture)")
      ->type_name("FOLDER");
  app.add_option("--rate", options.rate, "Frames a second")->check(CLI::Range(0.1, 48.0))->capture_default_str();
  app.add_option("--pairs", options.pairs, "Interrupt the program once this many were sent (0: it ends by itself)");
  app.add_option("--output", options.output, "File for the program's standard output")->type_name("FILE");
  app.add_option("--errors", options.errors, "File for the program's standard error")->type_name("FILE");
  app.add_option("--report", options.report, "File for a JSON object: exit_code, frames, lost, cpu_s")
      ->type_name("FILE")
      ->required();
  app.add_option("command", options.command, "The program and its arguments, behind --")->required();
  relmap::terminal::add_standard_options(app);
  app.footer(
      "Example:\n"
      "  relmap-simulated-camera --report r.json -- $PWD/build/release/bin/relmap-camera record a.raw --frames 100\n"
      "\n"
      "Exit codes:\n"
      "  0  done\n"
      "  1  failed\n"
      "  2  wrong usage");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return relmap::terminal::end_with(app, error, std::cout, std::cerr, 2);
  }
  relmap::testing::start_under_mock(argv);
  try {
    return relmap::testing::run(options);
  } catch (const std::exception& e) {
    std::cerr << "relmap-simulated-camera: " << e.what() << '\n';
    return 1;
  }
}
