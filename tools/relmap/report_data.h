// What a report tells of a map: gathered from the daemon (report_data.cc), written as a page (report_page.h).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client/relmap_client.h"
#include "tools/relmap/relaxed_map.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

struct MapReport {
  std::string title;
  std::int64_t made_us = 0;
  client::DaemonStatus status;
  std::vector<client::Session> sessions;
  std::map<std::string, std::uint64_t> keyframes_by_day;  // "2026-11-30", UTC; of sessions that are drawn

  // The map, drawn. Not ok: why it is not.
  std::string map_svg;
  Status map_missing;
  std::size_t parts = 0;
  std::vector<Tear> tears, strained;  // the worst first

  std::vector<client::ClosureMatrixCell> matrix;
  Status matrix_missing;
  // Closures in force, the most suspicious first, each with the pictures of its ends.
  struct Suspicious {
    client::Edge edge;
    std::string svg;
  };
  std::vector<Suspicious> suspicious;
  Status suspicious_missing;

  // Mean reprojection errors of some frames, chosen evenly, pixels, ascending.
  struct SessionErrors {
    SessionNumber session = 0;
    std::vector<double> pixels;
  };
  std::vector<SessionErrors> errors;
  // Standard deviations of positions relative to the root of the largest part, metres, ascending.
  std::vector<double> sigmas_m;
  FrameId sigmas_root;

  std::vector<client::RobotStatus> robots;
  Status robots_missing;
  client::StoreStats store;
  Status store_missing;
  client::AuditLog audit;
  Status audit_missing;
};

struct ReportOptions {
  std::string out, title = "relmap report";
  std::size_t suspicious = 5;  // closures that are shown
  bool map = true;             // false: the map is not drawn, which of a large one takes minutes
};

// Asks the daemon for all that a report tells. What it refuses is left out, with its reason; only if it tells neither
// its status nor its sessions is there no report.
Result<MapReport> gather_report(const ReportOptions& options, client::Client& client, terminal::Console& console);

}  // namespace relmap::cli
