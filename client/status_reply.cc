#include "client/replies.h"
#include "proto/wire/convert.h"
#include "relmap/v1/status.pb.h"

namespace relmap::client {

namespace {

ReasonCounts read_counts(const google::protobuf::RepeatedPtrField<v1::ReasonCount>& messages) {
  ReasonCounts counts;
  for (const v1::ReasonCount& m : messages) counts[reason_from_wire(m.reason())] += m.count();
  return counts;
}

Status read_state(int reason, const std::string& message) {
  return reason == v1::REASON_OK ? Status() : Status(reason_from_wire(reason), message);
}

}  // namespace

DaemonStatus read_status(const v1::GetStatusReply& m) {
  DaemonStatus s;
  s.version = m.version();
  s.boot_id = m.boot_id();
  if (const auto uuid = Uuid::parse(m.map_uuid())) s.map = {*uuid, m.map_epoch()};
  s.data_folder = m.data_folder();
  s.lcm_url = m.lcm_url();
  s.caller_name = m.caller_name();
  s.caller_role = m.caller_role();
  s.pid = m.pid();
  s.uptime_us = m.uptime_us();
  s.deterministic = m.deterministic();
  s.storage = read_state(m.storage_reason(), m.storage_message());
  s.lcm = read_state(m.lcm_reason(), m.lcm_message());
  s.connections = read_state(m.connections().reason(), m.connections().message());
  s.access = read_state(m.access_reason(), m.access_message());
  s.certificate = read_state(m.certificate_reason(), m.certificate_message());
  s.connections_open = m.connections().open();
  s.connections_refused = m.connections().refused();
  s.connections_displaced = m.connections().displaced();
  s.map_version = m.map_version();
  s.sessions = m.sessions();
  s.labels = m.labels();
  s.frames = m.frames();
  s.gaps = m.gaps();
  s.refused = m.refused();
  s.places = m.places();
  s.places_left_out = m.places_left_out();
  s.refused_by_reason = read_counts(m.refused_by_reason());
  for (const v1::DoubtfulCamera& camera : m.doubtful_cameras())
    s.doubtful_cameras.push_back({camera.session(),
                                  camera.robot(),
                                  camera.name(),
                                  {camera.against().begin(), camera.against().end()},
                                  camera.contradicted(),
                                  camera.message()});
  s.route_chunks = m.route_cells().chunks();
  s.route_chunks_changed = m.route_cells().changed_chunks();
  s.route_cells_outdated = m.route_cells().outdated_cells();
  s.route_weights = m.route_cells().weights();
  s.routes_missing_because = m.route_cells().missing_because();
  s.closures_candidate = m.loop_closures().candidate();
  s.closures_accepted = m.loop_closures().accepted();
  s.closures_quarantined = m.loop_closures().quarantined();
  s.closures_removed = m.loop_closures().removed();
  s.durable_sequence = m.durable_sequence();
  s.applied_sequence = m.applied_sequence();
  s.queued = m.queued();
  s.lookup_lag = m.lookup_lag();
  s.lookup_lag_s = m.lookup_lag_s();
  s.pending_frames = m.pending_frames();
  s.commit = m.commit();
  s.log_level = m.log_level();
  for (const v1::Component& part : m.components())
    s.components.emplace_back(part.name(), Status(reason_from_wire(part.reason()), part.message()));
  s.clock_steps = m.clock_steps();
  s.clock_step_s = m.last_clock_step_s();
  s.relaxation_p50_us = m.relaxation().p50_us();
  s.relaxation_p99_us = m.relaxation().p99_us();
  s.relaxation_max_us = m.relaxation().max_us();
  s.active_frames_mean = m.active_frames_mean();
  s.solves = m.solves();
  s.numerical_failures = m.numerical_failures();
  s.memory_budget = m.memory_budget();
  s.memory_used = m.memory_used();
  s.resident_bytes = m.resident_bytes();
  s.resident_max_bytes = m.resident_max_bytes();
  for (const v1::MemoryShare& share : m.memory_shares())
    s.memory_shares.push_back({share.name(), share.used(), share.allowance()});
  s.vocabulary_words = m.vocabulary_words();
  s.vocabulary_source = m.vocabulary_source();
  s.ingest_keyframes = m.ingest().keyframes();
  s.ingest_repeats = m.ingest().repeats();
  s.ingest_parts_corrupt = m.ingest().parts_corrupt();
  s.robots = m.ingest().robots();
  s.not_taken = read_counts(m.ingest().not_taken());
  return s;
}

RobotStatus read_robot(const v1::Robot& m) {
  RobotStatus r;
  r.uuid = m.uuid();
  r.session = m.session();
  r.robot = m.robot();
  r.name = m.name();
  r.keyframes_per_s = m.keyframes_per_s();
  r.bytes_per_s = m.bytes_per_s();
  r.silent_s = 1e-6 * static_cast<double>(m.silent_us());
  if (m.lag_us() >= 0) r.lag_s = 1e-6 * static_cast<double>(m.lag_us());
  r.next_sequence = m.next_sequence();
  r.seen = m.seen();
  r.missing = m.missing();
  r.incomplete = m.incomplete();
  r.pending = m.pending();
  r.queued_messages = m.queued_messages();
  r.dropped_messages = m.dropped_messages();
  r.credits = m.credits();
  r.refused = read_counts(m.refused());
  r.not_taken = read_counts(m.not_taken());
  r.blocked = reason_from_wire(m.blocked());
  r.limit_hz = m.limit_hz();
  r.same_name.assign(m.same_name().begin(), m.same_name().end());
  r.silent = m.silent();
  return r;
}

}  // namespace relmap::client
