// relmap-bench: the benchmarks behind the figures that relmap states of itself.
#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <vector>

#include "tools/bench/subcommand.h"
#include "tools/terminal/command_line.h"

namespace {

using relmap::bench::Subcommand;

const Subcommand kSubcommands[] = {
    {"answers", "Questions to a running daemon about the drive it has mapped, judged by truth",
     relmap::bench::declare_answers},
    {"closures", "Loop closures of a pose graph, some of them false, proposed to a map",
     relmap::bench::declare_closures},
    {"drive", "The map of a recording, in the folder of a stopped daemon, against truth", relmap::bench::declare_drive},
    {"fleet", "Robots over a bad network into a daemon: nothing lost, nothing twice, how soon acknowledged",
     relmap::bench::declare_fleet},
    {"fleet-robots", "Some robots of `fleet`, which starts them", relmap::bench::declare_fleet_robots},
    {"frontend", "The stereo front-end alone, on pictures with truth: speed, drift, honesty",
     relmap::bench::declare_frontend},
    {"places", "The place index in memory, and with its lists on disk", relmap::bench::declare_places},
    {"rba", "Adaptive relative bundle adjustment: figure of eight, loops, laps, exploration",
     relmap::bench::declare_rba},
    {"rides", "Drives on which the robot is carried, through pictures, front-end and map",
     relmap::bench::declare_rides},
    {"routes", "A route through a map far larger than memory", relmap::bench::declare_routes},
    {"storage", "A map taken in and read by storage's own API: speed, memory, bytes written",
     relmap::bench::declare_storage},
    {"unpack", "Raw frames of a stereo camera taken apart, beside a copy of as many bytes",
     relmap::bench::declare_unpack},
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Benchmarks of relmap.", "relmap-bench");
  app.require_subcommand(1);
  bool json = false;
  std::vector<std::pair<CLI::App*, relmap::bench::Run>> runs;
  for (const Subcommand& subcommand : kSubcommands) {
    CLI::App* own = app.add_subcommand(subcommand.name, subcommand.description);
    own->add_flag("--json", json, "Print one JSON object");
    own->footer(std::string("Example:\n  relmap-bench ") + subcommand.name + " --json");
    runs.emplace_back(own, subcommand.declare(*own));  // where more is needed than that, it says so
  }
  relmap::terminal::add_version(app);
  app.footer(
      "Examples:\n"
      "  relmap-bench rba --json\n"
      "  relmap-bench routes --help\n"
      "Exit codes: 0 done, 1 failed (the reason is printed), 2 wrong usage.");
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
