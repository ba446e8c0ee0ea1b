// What a report tells of a map: gathered from the daemon (report_data.cc), written as a page (report_page.h).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "client/relmap_client.h"
#include "client/tear.h"
#include "proto/base/quantile.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

struct MapReport {
  std::string title;
  std::int64_t made_us = 0;
  client::DaemonStatus status;
  std::vector<client::Session> sessions;
  std::map<std::string, std::uint64_t> keyframes_by_day;  // "2026-11-30", UTC; of sessions that are drawn

  // The map, drawn, if that was asked for. Not ok: why it is not.
  bool map_asked = true;
  std::string map_svg;
  Status map_missing;
  bool laid_out = false;  // parts, tears and sigmas are known
  std::size_t parts = 0;
  std::vector<client::Tear> tears;  // the worst first
  std::string map_text;             // how much of the map the picture shows; empty: every keyframe
  std::size_t mono_sessions = 0;    // which the picture does not show

  std::vector<client::ClosureMatrixCell> matrix;
  Status matrix_missing;
  // Closures in force, the most suspicious first: all whose suspicion is kSuspicious or more, as long as there are no
  // more than kMaxSuspicious, and those that are shown.
  struct Suspicious {
    client::Edge edge;
    std::string svg = {};   // the pictures of its ends; empty: they are not shown
    Status not_shown = {};  // not ok: they should be, and cannot
  };
  static constexpr std::size_t kMaxSuspicious = 1000;
  std::vector<Suspicious> suspicious;
  Status suspicious_missing;  // not ok: why they are not known
  // Those whose suspicion is kSuspicious or more.
  std::size_t suspicious_count() const;
  std::size_t shown() const;  // with pictures

  // Mean reprojection errors of some frames (sample_frames()), pixels, ascending.
  struct SessionErrors {
    SessionNumber session = 0;
    std::vector<double> pixels;
  };
  std::vector<SessionErrors> errors;
  // Standard deviations of positions relative to the root of the largest part, and for how many keyframes each is.
  std::vector<Weighted> sigmas;  // metres, ascending
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
  bool map = true;             // false: the map is not drawn
};

// Asks the daemon for all that a report tells. What it refuses is left out, with its reason; only if it tells neither
// its status nor its sessions is there no report.
Result<MapReport> gather_report(const ReportOptions& options, client::Client& client, terminal::Console& console);

}  // namespace relmap::cli
