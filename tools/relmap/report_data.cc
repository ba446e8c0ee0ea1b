#include "tools/relmap/report_data.h"

#include <algorithm>
#include <cmath>

#include "client/pair_picture.h"
#include "proto/base/clock.h"
#include "tools/relmap/map_drawing.h"
#include "tools/relmap/pairs.h"

namespace relmap::cli {

namespace {

constexpr std::size_t kSampledFrames = 120, kAuditEntries = 40;

Status draw_map(MapReport& report, client::Client& client, terminal::Console& console) {
  auto graph = read_map_graph({}, client, console);
  if (!graph.ok()) return graph.status();
  if (graph->frames.empty()) return nothing_to_place(*graph, "draw", "drawn");
  for (const auto& [frame, time] : frame_times(*graph)) ++report.keyframes_by_day[time_text(time).substr(0, 10)];
  const auto labels = client.labels();
  if (!labels.ok()) return labels.status();
  const auto map = relax_map(std::move(graph).value(), *labels);
  if (!map.ok()) return map.status();
  report.parts = map->parts.size();
  for (const MapPart& part : map->parts) report.tears.insert(report.tears.end(), part.tears.begin(), part.tears.end());
  std::stable_sort(report.tears.begin(), report.tears.end(),
                   [](const Tear& x, const Tear& y) { return x.sigmas > y.sigmas; });
  report.strained = map->strained;
  report.sigmas_root = map->parts[0].root;
  for (const double sigma : uncertainty_of(*map, map->parts[0]))
    if (std::isfinite(sigma)) report.sigmas_m.push_back(sigma);
  std::sort(report.sigmas_m.begin(), report.sigmas_m.end());
  client::MapPicture picture = picture_of(*map, false);
  mark_tears(*map, picture);
  auto svg = client::draw_map_picture(picture, client::PictureFormat::kSvg);
  if (!svg.ok()) return svg.status();
  report.map_svg = std::move(svg).value();
  return {};
}

Status show_suspicious(std::size_t count, MapReport& report, client::Client& client, terminal::Console& console) {
  if (count == 0) return {};
  client::EdgeFilter filter;
  filter.kinds = {client::EdgeKind::kLoop};
  filter.states = {client::EdgeState::kAccepted};
  filter.order = client::EdgeOrder::kSuspicion;
  filter.limit = count;
  const auto edges = client.edges(filter);
  if (!edges.ok()) return edges.status();
  if (!edges->empty() && !edges->front().suspicion)
    return {Reason::UNIMPLEMENTED, "this relmapd does not tell how suspicious closures are; it is an older one"};
  const auto sessions = read_sessions(client, console);
  if (!sessions.ok()) return sessions.status();
  for (const client::Edge& edge : *edges) {
    const auto explained = client.explain_edge(edge.id, /*with_pictures=*/true);
    if (!explained.ok()) return explained.status();
    auto svg = client::draw_pair(pair_of(*explained, *sessions, client), client::PictureFormat::kSvg);
    if (!svg.ok()) return svg.status();
    report.suspicious.push_back({explained->edge, std::move(svg).value()});
  }
  return {};
}

void sample_errors(MapReport& report, client::Client& client) {
  std::uint64_t frames = 0;
  for (const client::Session& session : report.sessions) frames += session.frames;
  for (const client::Session& session : report.sessions) {
    if (session.frames == 0) continue;
    // At least three of each session, so that a small one is not passed over.
    const auto wanted = std::max<std::uint64_t>(3, kSampledFrames * session.frames / frames);
    const std::uint32_t span = session.last - session.first;
    MapReport::SessionErrors errors{session.number, {}};
    for (std::uint64_t i = 0; i < wanted; ++i) {
      const auto index = session.first + static_cast<std::uint32_t>(span * i / std::max<std::uint64_t>(1, wanted - 1));
      const auto frame = client.frame({session.number, index});
      if (frame.ok() && frame->mean_error) errors.pixels.push_back(*frame->mean_error);
    }
    if (errors.pixels.empty()) continue;
    std::sort(errors.pixels.begin(), errors.pixels.end());
    report.errors.push_back(std::move(errors));
    if (report.errors.size() >= kSampledFrames) break;
  }
}

// Sets `into` to the answer, or `missing` to why there is none.
template <typename Value>
void take(Result<Value> answer, Value& into, Status& missing) {
  if (answer.ok())
    into = std::move(answer).value();
  else
    missing = answer.status();
}

}  // namespace

Result<MapReport> gather_report(const ReportOptions& options, client::Client& client, terminal::Console& console) {
  const terminal::Console::Aside aside(console);
  MapReport report;
  report.title = options.title;
  report.made_us = now_us();
  auto status = client.status();
  if (!status.ok()) return status.status();
  report.status = std::move(status).value();
  auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  report.sessions = std::move(sessions).value();
  if (options.map)
    report.map_missing = draw_map(report, client, console);
  else
    report.map_missing = {Reason::OUT_OF_REACH, "--no-map was given"};
  take(client.closure_matrix(), report.matrix, report.matrix_missing);
  report.suspicious_missing = show_suspicious(options.suspicious, report, client, console);
  sample_errors(report, client);
  take(client.robots(), report.robots, report.robots_missing);
  take(client.stats(), report.store, report.store_missing);
  client::AuditFilter audit;
  audit.limit = kAuditEntries;
  take(client.audit(audit), report.audit, report.audit_missing);
  return report;
}

}  // namespace relmap::cli
