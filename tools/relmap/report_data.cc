#include "tools/relmap/report_data.h"

#include <algorithm>

#include "client/pair_picture.h"
#include "proto/base/clock.h"
#include "proto/base/suspicion.h"
#include "tools/relmap/frame_sample.h"
#include "tools/relmap/map_drawing.h"
#include "tools/relmap/pairs.h"

namespace relmap::cli {

namespace {

constexpr std::size_t kSampledFrames = 120, kAuditEntries = 40;

// Whether it is drawn or not, the shape tells when keyframes were taken.
Status draw_map(bool drawn, MapReport& report, client::Client& client, terminal::Console& console) {
  const auto labels = client.labels();
  if (!labels.ok()) return labels.status();
  ShapeChoice choice;
  for (const client::LabelledFrames& label : *labels)
    choice.points.insert(choice.points.end(), label.frames.begin(), label.frames.end());
  auto shape = read_map_shape(choice, client, console);
  if (!shape.ok()) return shape.status();
  report.keyframes_by_day = keyframes_by_day(shape->skeleton);
  report.mono_sessions = shape->chosen.mono_sessions;
  if (!drawn) return {};
  if (Status laid_out = lay_out(*shape); !laid_out.ok()) return laid_out;
  report.laid_out = true;
  report.parts = shape->layout.parts.size();
  report.map_text = shape_text(*shape);
  report.tears = tears_of(*shape);
  report.sigmas_root = shape->layout.parts[0].root;
  report.sigmas = keyframe_sigmas(*shape);
  client::MapPicture picture = picture_of(*shape, *labels);
  mark_tears(report.tears, strained_of(*shape), picture);
  auto svg = client::draw_map_picture(picture, client::PictureFormat::kSvg);
  if (!svg.ok()) return svg.status();
  report.map_svg = std::move(svg).value();
  return {};
}

Status find_suspicious(std::size_t shown, MapReport& report, client::Client& client, terminal::Console& console) {
  client::EdgeFilter filter;
  filter.kinds = {client::EdgeKind::kLoop};
  filter.states = {client::EdgeState::kAccepted};
  filter.order = client::EdgeOrder::kSuspicion;
  filter.min_suspicion = kSuspicious;
  filter.limit = MapReport::kMaxSuspicious;
  auto edges = client.edges(filter);
  if (!edges.ok()) return edges.status();
  // A map without a suspicious closure has some that are the most suspicious.
  if (edges->size() < shown) {
    filter.min_suspicion = 0;
    filter.limit = shown;
    edges = client.edges(filter);
    if (!edges.ok()) return edges.status();
  }
  if (!edges->empty() && !edges->front().suspicion)
    return {Reason::UNIMPLEMENTED, "this relmapd does not tell how suspicious closures are; it is an older one"};
  for (client::Edge& edge : *edges) report.suspicious.push_back({std::move(edge)});
  const auto sessions = read_sessions(client, console);
  if (!sessions.ok()) return sessions.status();
  for (std::size_t i = 0; i < std::min(shown, report.suspicious.size()); ++i) {
    MapReport::Suspicious& closure = report.suspicious[i];
    const auto explained = client.explain_edge(closure.edge.id, /*with_pictures=*/true);
    if (!explained.ok()) {
      closure.not_shown = explained.status();
      continue;
    }
    auto svg = client::draw_pair(pair_of(*explained, *sessions, client), client::PictureFormat::kSvg);
    if (svg.ok())
      closure.svg = std::move(svg).value();
    else
      closure.not_shown = svg.status();
  }
  return {};
}

void sample_errors(MapReport& report, client::Client& client) {
  for (const SampledSession& sampled : sample_frames(report.sessions, kSampledFrames)) {
    MapReport::SessionErrors errors{sampled.session, {}};
    for (const std::uint32_t index : sampled.indices) {
      const auto frame = client.frame({sampled.session, index});
      if (frame.ok() && frame->mean_error) errors.pixels.push_back(*frame->mean_error);
    }
    if (errors.pixels.empty()) continue;
    std::sort(errors.pixels.begin(), errors.pixels.end());
    report.errors.push_back(std::move(errors));
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

std::size_t MapReport::suspicious_count() const {
  return static_cast<std::size_t>(std::count_if(suspicious.begin(), suspicious.end(), [](const Suspicious& closure) {
    return closure.edge.suspicion && closure.edge.suspicion->value >= kSuspicious;
  }));
}

std::size_t MapReport::shown() const {
  return static_cast<std::size_t>(std::count_if(suspicious.begin(), suspicious.end(),
                                                [](const Suspicious& closure) { return !closure.svg.empty(); }));
}

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
  report.map_asked = options.map;
  report.map_missing = draw_map(options.map, report, client, console);
  take(client.closure_matrix(), report.matrix, report.matrix_missing);
  report.suspicious_missing = find_suspicious(options.suspicious, report, client, console);
  sample_errors(report, client);
  take(client.robots(), report.robots, report.robots_missing);
  take(client.stats(), report.store, report.store_missing);
  client::AuditFilter audit;
  audit.limit = kAuditEntries;
  take(client.audit(audit), report.audit, report.audit_missing);
  return report;
}

}  // namespace relmap::cli
