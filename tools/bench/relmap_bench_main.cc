// relmap-bench: the benchmarks behind the figures that relmap states of itself.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <vector>

#include "tools/bench/subcommand.h"
#include "tools/terminal/command_line.h"

namespace {

using relmap::bench::Subcommand;

const Subcommand kSubcommands[] = {
    {"answers", "Ask a running daemon about the drive it has mapped, and compare with the truth",
     relmap::bench::declare_answers},
    {"by-eye", "Draw sheets of closures among which one is wrong, for people who try to find it by its pictures",
     relmap::bench::declare_by_eye},
    {"capture", "A live stereo camera: what a pair costs until it is recorded, until it is tracked, and what gets lost",
     relmap::bench::declare_capture},
    {"closures", "Propose the loop closures of a pose graph, some of them false, to a map",
     relmap::bench::declare_closures},
    {"drive", "Compare the map of a recording, in the folder of a stopped daemon, with the truth",
     relmap::bench::declare_drive},
    {"fleet", "Send keyframes of many robots over a bad network: losses, doubles, latency",
     relmap::bench::declare_fleet},
    {"fleet-robots", "Internal: a process with some robots of `fleet`", relmap::bench::declare_fleet_robots},
    {"frontend", "Run the stereo front-end alone on pictures with truth: speed, drift, covariances",
     relmap::bench::declare_frontend},
    {"ingest", "Take in keyframes with pictures: speed, cost, lag of lookups, closures", relmap::bench::declare_ingest},
    {"operations",
     "How soon faults show in health and metrics, what scrapes cost beside a fleet, how long a stop takes",
     relmap::bench::declare_operations},
    {"places", "Measure the place index in memory, and with its lists on disk", relmap::bench::declare_places},
    {"rba", "Measure adaptive relative bundle adjustment: figure of eight, loops, laps, exploration",
     relmap::bench::declare_rba},
    {"rides", "Run drives on which the robot is carried through front-end and map", relmap::bench::declare_rides},
    {"routes", "Find routes through a map far larger than memory", relmap::bench::declare_routes},
    {"security", "What seals, TLS, forgeries, crowds and strangers cost others", relmap::bench::declare_security},
    {"skeleton", "Draw the shape of a map of a million frames: first page, whole, bytes, layout",
     relmap::bench::declare_skeleton},
    {"storage", "Write and read a map by storage's own API: speed, memory, bytes written",
     relmap::bench::declare_storage},
    {"suspicion", "Plant wrong closures among true ones, and find them by how doubtful closures are",
     relmap::bench::declare_suspicion},
    {"unpack", "Unpack raw frames of a stereo camera, in comparison with a copy of as many bytes",
     relmap::bench::declare_unpack},
    {"vast", "A town driven for 150 km by a fleet, through a daemon that is killed and asked meanwhile",
     relmap::bench::declare_vast},
    {"watch", "Watch the map beside a fleet: latency of what happens, cost for the worker, memory",
     relmap::bench::declare_watch},
};

}  // namespace

int main(int argc, char** argv) {
  // The map logs; standard output is for figures.
  spdlog::set_default_logger(spdlog::stderr_color_mt("relmap-bench"));
  CLI::App app("Benchmarks of relmap.", "relmap-bench");
  app.require_subcommand(1);
  bool json = false;
  std::vector<std::pair<CLI::App*, relmap::bench::Run>> runs;
  for (const Subcommand& subcommand : kSubcommands) {
    CLI::App* own = app.add_subcommand(subcommand.name, subcommand.description);
    own->add_flag("--json", json, "Print one JSON object");
    own->footer(std::string("Example:\n  relmap-bench ") + subcommand.name + " --json");
    runs.emplace_back(own, subcommand.declare(*own));  // subcommands with required options set their own footer
  }
  relmap::terminal::add_standard_options(app);
  app.footer(
      "Examples:\n"
      "  relmap-bench rba --json\n"
      "  relmap-bench routes --help\n"
      "\n"
      "Exit codes:\n"
      "  0  done\n"
      "  1  failed; the reason is printed\n"
      "  2  wrong usage");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return relmap::terminal::end_with(app, error, std::cout, std::cerr, 2);
  }
  try {
    for (const auto& [own, run] : runs) {
      if (!own->parsed()) continue;
      relmap::bench::Report report;
      run(report);
      if (json)
        report.print_json(std::cout);
      else
        report.print_table(std::cout);
    }
  } catch (const std::exception& e) {
    std::cerr << "relmap-bench: " << e.what() << '\n';
    return 1;
  }
  return 0;
}
