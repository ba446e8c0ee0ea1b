#include "server/monitor/metrics_page.h"

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "proto/base/duration_histogram.h"
#include "server/monitor/log.h"
#include "server/rpc/gateway.h"

namespace relmap::monitor {

namespace {

constexpr std::chrono::seconds kStoreInterval{10};  // between looks at the sizes of files

constexpr const char *kGauge = "gauge", *kCounter = "counter", *kHistogram = "histogram";

using Labels = std::initializer_list<std::pair<const char*, std::string_view>>;

// Collects the metrics of a page.
class Collector {
 public:
  Collector() {
    for (const MetricFamily& family : metric_families()) {
      prometheus::MetricFamily& added = families_.emplace_back();
      added.name = family.name;
      added.help = family.meaning;
      added.type = family.type == kGauge     ? prometheus::MetricType::Gauge
                   : family.type == kCounter ? prometheus::MetricType::Counter
                                             : prometheus::MetricType::Histogram;
      by_name_.emplace(family.name, families_.size() - 1);
    }
  }

  void set(std::string_view name, double value, Labels labels = {}) {
    prometheus::ClientMetric& metric = add(name, labels);
    metric.gauge.value = value;
    metric.counter.value = value;
  }
  template <typename Number>
  void set(std::string_view name, Number value, Labels labels = {}) {
    set(name, static_cast<double>(value), labels);
  }
  void set(std::string_view name, const DurationCounts& counts, Labels labels = {}) {
    prometheus::ClientMetric::Histogram& histogram = add(name, labels).histogram;
    std::uint64_t so_far = 0;
    for (std::size_t i = 0; i < counts.buckets.size(); ++i) {
      so_far += counts.buckets[i];
      const double bound = i < kDurationBounds.size() ? kDurationBounds[i] : std::numeric_limits<double>::infinity();
      histogram.bucket.push_back({so_far, bound});
    }
    histogram.sample_count = so_far;
    histogram.sample_sum = counts.sum_s;
  }

  std::string text() {
    std::erase_if(families_, [](const prometheus::MetricFamily& family) { return family.metric.empty(); });
    return prometheus::TextSerializer().Serialize(families_);
  }

 private:
  prometheus::ClientMetric& add(std::string_view name, Labels labels) {
    const auto found = by_name_.find(name);
    if (found == by_name_.end()) throw std::logic_error("no metric is called " + std::string(name));
    prometheus::ClientMetric& metric = families_[found->second].metric.emplace_back();
    for (const auto& [label, value] : labels) metric.label.push_back({label, std::string(value)});
    return metric;
  }

  std::vector<prometheus::MetricFamily> families_;
  std::map<std::string, std::size_t, std::less<>> by_name_;
};

void collect_process(const rpc::Core& core, Collector& page) {
  page.set("relmap_build_info", 1, {{"version", core.facts.version}, {"commit", core.facts.commit}});
  page.set("process_start_time_seconds", 1e-6 * static_cast<double>(core.facts.started_us));
  if (core.process) {
    const rpc::ProcessFacts process = core.process();
    page.set("process_cpu_seconds_total", process.cpu_s);
    page.set("process_resident_memory_bytes", process.resident_bytes);
    page.set("process_open_fds", process.open_files);
    page.set("process_max_fds", process.max_files);
  }
  const LogCounts lines = log_counts();
  page.set("relmap_log_lines_total", lines.warnings, {{"level", "warning"}});
  page.set("relmap_log_lines_total", lines.errors, {{"level", "error"}});
  page.set("relmap_log_lines_total", lines.criticals, {{"level", "critical"}});
}

void collect_health(const rpc::HealthFacts& health, Collector& page) {
  page.set("relmap_live", health.live);
  page.set("relmap_ready", health.ready());
  for (const rpc::ComponentHealth& component : health.components) {
    page.set("relmap_component_ok", component.state.ok(), {{"component", component.name}});
    if (!component.state.ok())
      page.set("relmap_component_problem", 1,
               {{"component", component.name}, {"reason", reason_name(component.state.reason())}});
  }
  page.set("relmap_clock_steps_total", health.clock_steps);
  page.set("relmap_clock_step_seconds", health.clock_step_s);
}

void collect_work(const map::Mapper& mapper, const intake::IngestServer* intake, const map::MapperStats& stats,
                  Collector& page) {
  const map::MapperProgress progress = mapper.progress();
  page.set("relmap_busy_seconds", progress.journal_s, {{"thread", "journal"}});
  page.set("relmap_busy_seconds", progress.worker_s, {{"thread", "worker"}});
  page.set("relmap_busy_seconds", progress.commit_s, {{"thread", "commit"}});
  if (intake) page.set("relmap_busy_seconds", intake->busy_s(), {{"thread", "intake"}});
  page.set("relmap_journal_durable_sequence", stats.durable_sequence);
  page.set("relmap_journal_applied_sequence", stats.applied_sequence);
  page.set("relmap_queue_records", stats.waiting, {{"queue", "journal"}});
  page.set("relmap_queue_records", stats.queued, {{"queue", "worker"}});
  page.set("relmap_queue_records", stats.lookup_lag, {{"queue", "lookup"}});
  page.set("relmap_queue_lag_seconds", stats.worker_lag_s, {{"queue", "worker"}});
  page.set("relmap_queue_lag_seconds", stats.lookup_lag_s, {{"queue", "lookup"}});
  page.set("relmap_pending_frames", stats.pending_frames);
  page.set("relmap_acknowledgement_seconds", stats.acknowledgements);
  page.set("relmap_append_seconds", stats.appends);
  page.set("relmap_relaxation_seconds", stats.relaxations);
  page.set("relmap_lookup_seconds", stats.lookups);
  page.set("relmap_commit_seconds", stats.commits);
  page.set("relmap_commit_failures_total", stats.commit_failures);
}

void collect_map(const map::Mapper& mapper, const map::MapperStats& stats, Collector& page) {
  const auto view = mapper.view();
  const storage::MapFacts& state = view->state();
  page.set("relmap_sessions", view->session_counts().all);
  page.set("relmap_frames", state.keyframes);
  page.set("relmap_gaps", state.gaps);
  page.set("relmap_places", stats.places);
  page.set("relmap_places_left_out", stats.places_left_out);
  page.set("relmap_closures", state.closures_candidate, {{"state", "candidate"}});
  page.set("relmap_closures", state.closures_accepted, {{"state", "accepted"}});
  page.set("relmap_closures", state.closures_quarantined, {{"state", "quarantined"}});
  page.set("relmap_closures", state.closures_removed, {{"state", "removed"}});
  page.set("relmap_doubtful_cameras", stats.doubts.size());
}

void collect_intake(const rpc::Core& core, Collector& page) {
  if (!core.intake.server) return;
  const intake::IngestStats stats = core.intake.server->stats();
  page.set("relmap_parts_total", stats.parts);
  page.set("relmap_parts_repeated_total", stats.repeated_parts);
  page.set("relmap_keyframes_received_total", stats.keyframes_received);
  page.set("relmap_keyframes_durable_total", stats.keyframes_durable);
  page.set("relmap_keyframes_evicted_total", stats.evicted);
  page.set("relmap_keyframes_incomplete", stats.incomplete);
  page.set("relmap_acknowledgements_total", stats.acknowledgements);
  page.set("relmap_robots", stats.heard);
  for (std::size_t number = 1; number < stats.parts_refused.size(); ++number) {
    if (!is_reason(static_cast<std::uint16_t>(number))) continue;
    // Those of what robots send are there from the start, since Prometheus sees no increase to a first value.
    const bool always = number <= intake::index_of(Reason::MAP_RESTORED);
    const std::string_view reason = reason_name(static_cast<Reason>(number));
    if (always || stats.keyframes_refused[number] > 0)
      page.set("relmap_keyframes_refused_total", stats.keyframes_refused[number], {{"reason", reason}});
    const std::uint64_t messages = stats.parts_refused[number] + stats.messages_refused[number];
    if (always || messages > 0) page.set("relmap_messages_not_taken_total", messages, {{"reason", reason}});
  }
  const std::vector<intake::RobotStats> robots = core.intake.server->robots();
  page.set("relmap_robots_silent",
           std::count_if(robots.begin(), robots.end(), [](const intake::RobotStats& robot) { return robot.silent; }));
  if (!core.facts.lcm_url.empty() && core.intake.facts) page.set("relmap_lcm_up", core.intake.facts().lcm.ok());
}

void collect_rpc(const rpc::Core& core, Collector& page) {
  for (const auto& [method, counted] : core.metrics.methods())
    for (const auto& [outcome, durations] : counted.durations)
      page.set("relmap_rpc_seconds", durations, {{"method", method}, {"reason", reason_name(outcome)}});
  const rpc::Transport& transport = core.transport;
  if (transport.gateway) {
    using Kind = rpc::Gateway::Kind;
    for (const auto& [kind, name] :
         {std::pair(Kind::kQuestion, "question"), std::pair(Kind::kStream, "stream"), std::pair(Kind::kEdit, "edit"),
          std::pair(Kind::kWait, "wait"), std::pair(Kind::kWatch, "watch")})
      page.set("relmap_rpc_running", transport.gateway->running(kind), {{"kind", name}});
  }
  const rpc::WatchFeed::Counts watched = core.feed.counts();
  page.set("relmap_watch_events_total", watched.told);
  page.set("relmap_watch_resyncs_total", watched.resyncs);
  page.set("relmap_watch_lag_records", watched.lag);
  if (transport.connections) {
    const rpc::ConnectionCounts counts = transport.connections->counts(rpc::Connections::Clock::now());
    page.set("relmap_connections", counts.open);
    page.set("relmap_connections_limit", transport.connections->limits().total);
    page.set("relmap_connections_refused_total", counts.refused);
    page.set("relmap_connections_displaced_total", counts.displaced);
  }
  if (transport.gatekeeper)
    page.set("relmap_credentials_ok", transport.gatekeeper->problem().ok(), {{"file", "access"}});
  if (transport.tls) page.set("relmap_credentials_ok", transport.tls->state().ok(), {{"file", "certificate"}});
}

void collect_memory(const storage::Budget& budget, Collector& page) {
  page.set("relmap_memory_budget_bytes", budget.limit());
  for (std::size_t i = 0; i < storage::kShares; ++i) {
    const auto share = static_cast<storage::Share>(i);
    const std::string_view name = storage::share_name(share);
    page.set("relmap_memory_used_bytes", budget.used(share), {{"share", name}});
    page.set("relmap_memory_allowance_bytes", budget.allowance(share), {{"share", name}});
  }
}

void collect_disk(const std::string& folder, std::uint64_t low_water, Collector& page) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  if (!error) {
    page.set("relmap_disk_free_bytes", space.available);
    page.set("relmap_disk_size_bytes", space.capacity);
  }
  page.set("relmap_disk_low_water_bytes", low_water);
}

void collect_routes(const rpc::Routes& routes, Collector& page) {
  page.set("relmap_route_cells", routes.index && routes.index->snapshot().overlay);
  page.set("relmap_route_searches_total", routes.searched.load());
}

}  // namespace

const std::vector<MetricFamily>& metric_families() {
  static const std::vector<MetricFamily> families{
      {"relmap_build_info", kGauge, "version, commit", "1"},
      {"process_start_time_seconds", kGauge, "", "Unix time at which the process started"},
      {"process_cpu_seconds_total", kCounter, "", "Processor time, of user and system"},
      {"process_resident_memory_bytes", kGauge, "", "Memory that the process has in RAM"},
      {"process_open_fds", kGauge, "", "Files and connections that are open"},
      {"process_max_fds", kGauge, "", "Files and connections that may be open"},
      {"relmap_live", kGauge, "",
       "1: journal, worker and intake make progress. 0: one has been at a piece of work for longer than hung_after_s, "
       "and systemd's watchdog is not fed"},
      {"relmap_ready", kGauge, "", "1: keyframes are taken in and questions answered, as /readyz says"},
      {"relmap_component_ok", kGauge, "component", "1 or 0 of storage, worker and intake"},
      {"relmap_component_problem", kGauge, "component, reason",
       "1 while a component has this problem; absent otherwise"},
      {"relmap_busy_seconds", kGauge, "thread",
       "For how long journal, worker, commit or intake has been at its present piece of work; 0: it waits for one"},
      {"relmap_clock_steps_total", kCounter, "", "Steps of the system's clock by more than a second"},
      {"relmap_clock_step_seconds", kGauge, "", "The last of these steps; forward is positive"},
      {"relmap_log_lines_total", kCounter, "level", "Lines of the log at warning, error and critical"},
      {"relmap_disk_free_bytes", kGauge, "", "Free on the file system of the data folder"},
      {"relmap_disk_size_bytes", kGauge, "", "Size of that file system"},
      {"relmap_disk_low_water_bytes", kGauge, "", "With less free disk space nothing is taken in"},
      {"relmap_store_bytes", kGauge, "part",
       "On disk: map, journal, and garbage (the part of the map that compact would free)"},
      {"relmap_journal_durable_sequence", kGauge, "", "Last record that is durable"},
      {"relmap_journal_applied_sequence", kGauge, "", "Last record that is in the map"},
      {"relmap_queue_records", kGauge, "queue",
       "Waiting: journal (not durable yet), worker (durable, not applied), lookup (applied, place not looked up)"},
      {"relmap_queue_lag_seconds", kGauge, "queue", "For how long the first of them has waited: worker, lookup"},
      {"relmap_pending_frames", kGauge, "", "Frames that wait for relaxation"},
      {"relmap_acknowledgement_seconds", kHistogram, "", "From a complete keyframe until it is durable"},
      {"relmap_append_seconds", kHistogram, "", "An append to the journal with its fsync"},
      {"relmap_relaxation_seconds", kHistogram, "", "Relative bundle adjustment of a keyframe"},
      {"relmap_lookup_seconds", kHistogram, "", "Recognition of the place of a keyframe"},
      {"relmap_commit_seconds", kHistogram, "", "A commit, until it is written"},
      {"relmap_commit_failures_total", kCounter, "", "Commits that failed, and are tried again"},
      {"relmap_sessions", kGauge, "", "Sessions of the map"},
      {"relmap_frames", kGauge, "", "Keyframes in the map"},
      {"relmap_gaps", kGauge, "", "Keyframes that robots gave up"},
      {"relmap_places", kGauge, "", "Frames that can be recognised"},
      {"relmap_places_left_out", kGauge, "", "Frames that cannot, for want of memory or disk space"},
      {"relmap_closures", kGauge, "state", "Loop closures: candidate, accepted, quarantined, removed"},
      {"relmap_doubtful_cameras", kGauge, "", "Sessions whose pictures contradict their calibration"},
      {"relmap_parts_total", kCounter, "", "Parts of keyframes received, and keyframes that came whole"},
      {"relmap_parts_repeated_total", kCounter, "", "Of these, of keyframes that had come already"},
      {"relmap_keyframes_received_total", kCounter, "", "Complete keyframes"},
      {"relmap_keyframes_durable_total", kCounter, "", "Keyframes written to the journal"},
      {"relmap_keyframes_refused_total", kCounter, "reason", "Keyframes refused for good"},
      {"relmap_messages_not_taken_total", kCounter, "reason",
       "Parts and other messages that were not taken; robots send them again where that helps"},
      {"relmap_keyframes_evicted_total", kCounter, "",
       "Incomplete keyframes dropped for want of memory; robots send them again"},
      {"relmap_keyframes_incomplete", kGauge, "", "Keyframes of which parts are missing now"},
      {"relmap_acknowledgements_total", kCounter, "", "Acknowledgements sent"},
      {"relmap_robots", kGauge, "", "Sessions heard from in the last minute"},
      {"relmap_robots_silent", kGauge, "", "Sessions that have not ended, and were last heard one to ten minutes ago"},
      {"relmap_lcm_up", kGauge, "", "1: LCM is listened to. 0: it could not start. Absent without LCM"},
      {"relmap_rpc_seconds", kHistogram, "method, reason", "Finished calls, by method and outcome"},
      {"relmap_rpc_running", kGauge, "kind", "Calls not answered yet: question, stream, edit, wait, watch"},
      {"relmap_watch_events_total", kCounter, "", "Events of the map told, counted for each watcher"},
      {"relmap_watch_resyncs_total", kCounter, "",
       "Watchers told to list again: what they had missed was no longer kept, or their map was another one"},
      {"relmap_watch_lag_records", kGauge, "", "Committed records that the slowest watcher has not been told of"},
      {"relmap_connections", kGauge, "", "Open connections of gRPC"},
      {"relmap_connections_limit", kGauge, "", "So many over TCP may be open, and as many at the socket"},
      {"relmap_connections_refused_total", kCounter, "", "Connections refused for want of room"},
      {"relmap_connections_displaced_total", kCounter, "", "Connections closed to make room"},
      {"relmap_credentials_ok", kGauge, "file",
       "0: the access list cannot be read; the certificate cannot be used, or expires within two weeks"},
      {"relmap_memory_budget_bytes", kGauge, "", "The memory budget"},
      {"relmap_memory_used_bytes", kGauge, "share", "What each share of it uses"},
      {"relmap_memory_allowance_bytes", kGauge, "share", "What each share may use at most"},
      {"relmap_route_cells", kGauge, "", "1: routes are found by cells. 0: frame by frame"},
      {"relmap_route_searches_total", kCounter, "", "Routes searched"},
  };
  return families;
}

std::string metrics_table() {
  std::string table = "| name | type | labels | meaning |\n|---|---|---|---|\n";
  for (const MetricFamily& family : metric_families())
    table += "| `" + std::string(family.name) + "` | " + family.type + " | " + family.labels + " | " + family.meaning +
             " |\n";
  return table;
}

MetricsPage::MetricsPage(const rpc::Core& core, std::string folder, std::uint64_t low_water)
    : core_(core), folder_(std::move(folder)), low_water_(low_water) {}

const storage::EngineStats& MetricsPage::store() {
  const auto now = std::chrono::steady_clock::now();
  if (store_read_ && now - *store_read_ < kStoreInterval) return store_;
  if (auto stats = core_.mapper.engine().stats(); stats.ok()) store_ = std::move(*stats);
  store_read_ = now;
  return store_;
}

std::optional<std::string> MetricsPage::text() {
  {
    const MutexLock lock(mutex_);
    if (making_) return std::nullopt;
    making_ = true;
  }
  struct Done {
    MetricsPage& page;
    ~Done() {
      const MutexLock lock(page.mutex_);
      page.making_ = false;
    }
  } const done{*this};
  Collector page;
  collect_process(core_, page);
  if (core_.health) collect_health(core_.health(), page);
  const map::MapperStats stats = core_.mapper.stats();
  collect_work(core_.mapper, core_.intake.server, stats, page);
  collect_map(core_.mapper, stats, page);
  collect_intake(core_, page);
  collect_rpc(core_, page);
  collect_memory(core_.mapper.budget(), page);
  collect_disk(folder_, low_water_, page);
  const storage::EngineStats& sizes = store();
  page.set("relmap_store_bytes", sizes.map_bytes, {{"part", "map"}});
  page.set("relmap_store_bytes", sizes.journal_bytes, {{"part", "journal"}});
  page.set("relmap_store_bytes", sizes.garbage_bytes, {{"part", "garbage"}});
  collect_routes(core_.routes, page);
  return page.text();
}

}  // namespace relmap::monitor
