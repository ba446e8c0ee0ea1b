#include <algorithm>
#include <chrono>

#include "proto/base/clock.h"
#include "proto/wire/channels.h"
#include "proto/wire/convert.h"
#include "relmap/v1/admin.pb.h"
#include "relmap/v1/status.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/log_level.h"
#include "server/rpc/messages.h"
#include "server/rpc/request_context.h"

namespace relmap::rpc {

namespace {

constexpr std::chrono::milliseconds kWaitSlice{100};

void put_daemon(const DaemonFacts& facts, v1::GetStatusReply& reply) {
  reply.set_version(facts.version);
  reply.set_commit(facts.commit);
  reply.set_boot_id(facts.boot_id);
  reply.mutable_protocol()->set_major(kProtocolMajor);
  reply.mutable_protocol()->set_minor(kProtocolMinor);
  reply.set_pid(facts.pid);
  reply.set_time_us(now_us());
  reply.set_uptime_us(now_us() - facts.started_us);
  reply.set_data_folder(facts.data_folder);
  reply.set_lcm_url(facts.lcm_url);
  reply.set_deterministic(facts.deterministic);
}

void put_map(const MapIdentity& identity, const storage::MapView& view, v1::GetStatusReply& reply) {
  if (identity.known()) reply.set_map_uuid(identity.uuid.to_string());
  reply.set_map_epoch(identity.epoch);
  const storage::MapFacts& state = view.state();
  reply.set_map_version(view.version());
  reply.set_sessions(static_cast<std::uint32_t>(view.session_counts().all));
  reply.set_frames(state.keyframes);
  reply.set_gaps(state.gaps);
  std::uint64_t refused = 0;
  for (std::size_t number = 0; number < state.refused.size(); ++number) {
    refused += state.refused[number];
    if (state.refused[number] > 0)
      add_count(*reply.mutable_refused_by_reason(), static_cast<Reason>(number), state.refused[number]);
  }
  reply.set_refused(refused);
  reply.mutable_loop_closures()->set_candidate(state.closures_candidate);
  reply.mutable_loop_closures()->set_accepted(state.closures_accepted);
  reply.mutable_loop_closures()->set_quarantined(state.closures_quarantined);
  reply.mutable_loop_closures()->set_removed(state.closures_removed);
  reply.set_labels(static_cast<std::uint32_t>(view.labels("").size()));
  reply.set_numerical_failures(state.numerical_failures);
}

void put_work(const map::MapperStats& stats, v1::GetStatusReply& reply) {
  reply.set_storage_reason(to_wire(stats.storage.reason()));
  reply.set_storage_message(stats.storage.message());
  reply.set_places(stats.places);
  reply.set_places_left_out(stats.places_left_out);
  reply.set_durable_sequence(stats.durable_sequence);
  reply.set_applied_sequence(stats.applied_sequence);
  reply.set_queued(stats.queued);
  reply.set_lookup_lag(stats.lookup_lag);
  reply.set_lookup_lag_s(stats.lookup_lag_s);
  reply.set_pending_frames(stats.pending_frames);
  reply.mutable_relaxation()->set_p50_us(stats.rba_p50_us);
  reply.mutable_relaxation()->set_p99_us(stats.rba_p99_us);
  reply.mutable_relaxation()->set_max_us(stats.rba_max_us);
  reply.set_active_frames_mean(stats.active_frames_mean);
  reply.set_solves(stats.rba_solves);
}

void put_doubts(const std::vector<map::CameraDoubt>& doubts, const storage::MapView& view, v1::GetStatusReply& reply) {
  for (const map::CameraDoubt& doubt : doubts) {
    const auto session = view.session(doubt.session);
    if (!session || storage::is_going(*session)) continue;
    v1::DoubtfulCamera& camera = *reply.add_doubtful_cameras();
    camera.set_session(doubt.session);
    camera.set_robot(session->header.robot);
    camera.set_name(session->header.name);
    camera.mutable_against()->Add(doubt.against.begin(), doubt.against.end());
    camera.set_contradicted(doubt.contradicted);
    camera.set_message(doubt.message);
  }
}

void put_routes(const Routes& routes, v1::GetStatusReply& reply) {
  v1::RouteCells& cells = *reply.mutable_route_cells();
  if (!routes.index) return cells.set_missing_because("there are none");
  const route::RouteIndex::Snapshot map = routes.index->snapshot();
  cells.set_missing_because(map.missing_because);
  if (!map.overlay) return;
  cells.set_weights(static_cast<std::uint32_t>(map.overlay->metrics().size()));
  cells.set_chunks(map.overlay->tree().chunks());
  cells.set_changed_chunks(map.stale.size());
  cells.set_outdated_cells(map.overlay->outdated());
}

void put_memory(const storage::Budget& budget, const ProcessProbe& probe, v1::GetStatusReply& reply) {
  reply.set_memory_budget(budget.limit());
  reply.set_memory_used(budget.used());
  for (std::size_t i = 0; i < storage::kShares; ++i) {
    const auto share = static_cast<storage::Share>(i);
    v1::MemoryShare& added = *reply.add_memory_shares();
    added.set_name(std::string(storage::share_name(share)));
    added.set_used(budget.used(share));
    added.set_allowance(budget.allowance(share));
  }
  if (!probe) return;
  const ProcessFacts process = probe();
  reply.set_resident_bytes(process.resident_bytes);
  reply.set_resident_max_bytes(process.peak_resident_bytes);
}

void put_ingest(const IngestFacts& facts, v1::GetStatusReply& reply) {
  reply.set_lcm_reason(to_wire(facts.lcm.reason()));
  reply.set_lcm_message(facts.lcm.message());
  v1::IngestCounts& counts = *reply.mutable_ingest();
  counts.set_parts(facts.parts);
  counts.set_parts_corrupt(facts.parts_corrupt);
  counts.set_keyframes(facts.keyframes);
  counts.set_repeats(facts.repeats);
  counts.set_acknowledgements(facts.acknowledgements);
  counts.set_robots(facts.robots);
  counts.set_incomplete(facts.incomplete);
  for (const auto& [reason, count] : facts.not_taken) add_count(*counts.mutable_not_taken(), reason, count);
}

void put_connections(const Connections& connections, v1::GetStatusReply& reply) {
  const ConnectionCounts now = connections.counts(Connections::Clock::now());
  v1::ConnectionCounts& counts = *reply.mutable_connections();
  counts.set_open(now.open);
  counts.set_limit(connections.limits().total);
  counts.set_refused(now.refused);
  counts.set_displaced(now.displaced);
  counts.set_reason(to_wire(now.trouble.reason()));
  counts.set_message(now.trouble.message());
}

void put_health(const HealthFacts& health, v1::GetStatusReply& reply) {
  for (const ComponentHealth& component : health.components) {
    v1::Component& added = *reply.add_components();
    added.set_name(component.name);
    added.set_reason(to_wire(component.state.reason()));
    added.set_message(component.state.message());
  }
  reply.set_clock_steps(health.clock_steps);
  reply.set_last_clock_step_s(health.clock_step_s);
}

void put_methods(const Metrics& metrics, v1::GetStatusReply& reply) {
  for (const auto& [name, counted] : metrics.methods()) {
    v1::MethodCount& method = *reply.add_methods();
    method.set_method(name);
    std::uint64_t calls = 0, failures = 0;
    double sum_s = 0;
    for (const auto& [outcome, durations] : counted.durations) {
      const std::uint64_t count = durations.total();
      calls += count;
      sum_s += durations.sum_s;
      if (outcome == Reason::OK) continue;
      failures += count;
      add_count(*method.mutable_failures_by_reason(), outcome, count);
    }
    method.set_calls(calls);
    method.set_failures(failures);
    method.set_mean_us(sum_s * 1e6 / static_cast<double>(calls));
    method.set_max_us(counted.max_s * 1e6);
  }
}

}  // namespace

Result<v1::GetStatusReply> get_status(const v1::GetStatusRequest&, const Deadline&, map::Mapper& mapper,
                                      const DaemonFacts& facts, const Routes& routes, const Intake& intake,
                                      const ProcessProbe& process, const Transport& transport,
                                      const HealthProbe& health, const Metrics& metrics) {
  v1::GetStatusReply reply;
  put_daemon(facts, reply);
  const auto view = mapper.view();
  put_map(mapper.identity(), *view, reply);
  const map::MapperStats stats = mapper.stats();
  put_work(stats, reply);
  put_doubts(stats.doubts, *view, reply);
  put_memory(mapper.budget(), process, reply);
  put_routes(routes, reply);
  const place::Vocabulary& vocabulary = mapper.vocabulary();
  reply.set_vocabulary_crc32c(vocabulary.crc());
  reply.set_vocabulary_words(vocabulary.size());
  reply.set_vocabulary_source(vocabulary.source());
  if (intake.facts) put_ingest(intake.facts(), reply);
  if (transport.connections) put_connections(*transport.connections, reply);
  if (transport.gatekeeper) {
    const Status problem = transport.gatekeeper->problem();
    reply.set_access_reason(to_wire(problem.reason()));
    reply.set_access_message(problem.message());
  }
  if (transport.tls) {
    const Status state = transport.tls->state();
    reply.set_certificate_reason(to_wire(state.reason()));
    reply.set_certificate_message(state.message());
  }
  if (health) put_health(health(), reply);
  reply.set_log_level(log_level());
  if (const RequestContext* const request = current_request()) {
    reply.set_caller_name(request->caller);
    reply.set_caller_role(request->role);
  }
  put_methods(metrics, reply);
  return reply;
}

Result<v1::WaitIdleReply> wait_idle(const v1::WaitIdleRequest&, const Deadline& deadline, map::Mapper& mapper) {
  for (;;) {
    if (Status status = deadline.check(); !status.ok()) return status;
    const Status idle = mapper.wait_idle(std::min(deadline.at, std::chrono::steady_clock::now() + kWaitSlice));
    if (idle.ok()) break;
    if (idle.reason() != Reason::DEADLINE) return idle;
  }
  v1::WaitIdleReply reply;
  reply.set_applied_sequence(mapper.stats().applied_sequence);
  reply.set_map_version(mapper.view()->version());
  return reply;
}

}  // namespace relmap::rpc
