// A benchmark: one file, one entry of the table in relmap_bench_main.cc.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

#include "tools/bench/report.h"

namespace relmap::bench {

using Run = std::function<void(Report&)>;

struct Subcommand {
  const char* name;
  const char* description;
  // Declares its own options on `app` and gives what runs it once they are parsed.
  Run (*declare)(CLI::App& app);
};

Run declare_answers(CLI::App& app);
Run declare_by_eye(CLI::App& app);
Run declare_capture(CLI::App& app);
Run declare_closures(CLI::App& app);
Run declare_drive(CLI::App& app);
Run declare_fleet(CLI::App& app);
Run declare_fleet_robots(CLI::App& app);
Run declare_frontend(CLI::App& app);
Run declare_ingest(CLI::App& app);
Run declare_operations(CLI::App& app);
Run declare_places(CLI::App& app);
Run declare_rba(CLI::App& app);
Run declare_rides(CLI::App& app);
Run declare_routes(CLI::App& app);
Run declare_security(CLI::App& app);
Run declare_skeleton(CLI::App& app);
Run declare_storage(CLI::App& app);
Run declare_suspicion(CLI::App& app);
Run declare_unpack(CLI::App& app);
Run declare_vast(CLI::App& app);
Run declare_watch(CLI::App& app);

}  // namespace relmap::bench
