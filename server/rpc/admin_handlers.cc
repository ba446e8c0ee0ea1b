#include <spdlog/spdlog.h>

#include <filesystem>
#include <memory>

#include "proto/wire/convert.h"
#include "relmap/v1/admin.pb.h"
#include "server/rpc/charge.h"
#include "server/rpc/handlers.h"
#include "server/rpc/job_stream.h"
#include "server/rpc/log_level.h"
#include "storage/maintenance/verify.h"

namespace relmap::rpc {

namespace {

constexpr int kFindingsPerMessage = 200;

template <typename Reply>
Result<Producer<Reply>> start(MaintenanceTurn& maintenance, const std::string& method, const Deadline& deadline,
                              std::function<Status(JobStream<Reply>&)> job) {
  auto turn = maintenance.take(method);
  if (!turn.ok()) return turn.status();
  const auto stream = std::make_shared<JobStream<Reply>>(*std::move(turn), deadline, std::move(job));
  return Producer<Reply>([stream] { return stream->take(); });
}

v1::Progress progress_of(const std::string& step, std::uint64_t done, std::uint64_t total, const std::string& unit) {
  v1::Progress progress;
  progress.set_step(step);
  progress.set_done(done);
  progress.set_total(total);
  progress.set_unit(unit);
  return progress;
}

// Shows the engine's progress, in bytes, to the stream.
storage::EngineProgress engine_progress(JobStream<v1::Progress>& stream, const std::string& step) {
  return [&stream, step](std::uint64_t done, std::uint64_t total) {
    stream.show(progress_of(step, done, total, "bytes"));
    return stream.check();
  };
}

v1::Finding finding_message(const storage::Finding& finding) {
  v1::Finding message;
  message.set_reason(to_wire(finding.reason));
  if (finding.frame.session != 0) *message.mutable_frame() = to_wire(finding.frame);
  message.set_message(finding.what);
  return message;
}

// Collects the findings of a verification into messages.
class VerifyReport {
 public:
  explicit VerifyReport(JobStream<v1::VerifyReply>& stream) : stream_(stream) {}

  storage::OnFinding on_finding() {
    return [this](const storage::Finding& finding) {
      *unsent_.add_findings() = finding_message(finding);
      if (unsent_.findings_size() >= kFindingsPerMessage) send();
    };
  }
  storage::OnProgress on_progress() {
    return [this](const storage::MaintenanceProgress& p) {
      if (unsent_.findings_size() > 0) send();
      v1::VerifyReply reply;
      *reply.mutable_progress() = progress_of(p.step, p.done, p.total, p.unit);
      stream_.show(reply);
      return stream_.check().ok();
    };
  }
  void conclude(const storage::VerifySummary& map, const storage::VerifySummary& journal) {
    v1::VerifySummary& summary = *unsent_.mutable_summary();
    summary.set_sessions(map.sessions);
    summary.set_frames(map.frames);
    summary.set_edges(map.edges);
    summary.set_landmarks(map.landmarks);
    summary.set_observations(map.observations);
    summary.set_features(map.features);
    summary.set_journal_records(journal.journal_records);
    summary.set_findings(map.findings + journal.findings);
    send();
  }

 private:
  void send() {
    stream_.send(std::move(unsent_));
    unsent_.Clear();
  }

  JobStream<v1::VerifyReply>& stream_;
  v1::VerifyReply unsent_;
};

Status verify_map(map::Mapper& mapper, const storage::VerifyOptions& options, JobStream<v1::VerifyReply>& stream) {
  storage::Budget& budget = mapper.budget();
  constexpr storage::Share kShare = storage::Share::kReplies;
  const storage::VerifyOptions within = storage::beside_others(options, budget, kShare);
  Charge charge(budget, kShare);
  if (Status charged = charge.grow_to(within.memory_bytes); !charged.ok()) return charged;
  VerifyReport report(stream);
  const storage::Engine& engine = mapper.engine();
  const auto map = storage::verify(*engine.snapshot(), within, report.on_finding(), report.on_progress());
  if (!map.ok()) return map.status();
  if (!map->complete) return stream.check();
  const auto journal = storage::verify_journal(engine, report.on_finding(), report.on_progress());
  if (!journal.ok()) return journal.status();
  if (!journal->complete) return stream.check();
  report.conclude(*map, *journal);
  return {};
}

std::uint64_t bytes_in(const std::string& folder) {
  std::uint64_t sum = 0;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (std::error_code gone; it->is_regular_file(gone)) sum += it->file_size(gone);
  return sum;
}

Status only_without_a_daemon(const DaemonFacts& facts, const std::string& done, const std::string& command) {
  const std::string& folder = facts.data_folder;
  return {Reason::FOLDER_LOCKED, "this daemon owns " + folder + ", and a map is " + done +
                                     " while none works on it: stop the daemon and run `relmap-admin " + command + " " +
                                     folder + "`"};
}

}  // namespace

Result<Producer<v1::VerifyReply>> verify_request(const v1::VerifyRequest& request, const Deadline& deadline,
                                                 map::Mapper& mapper, MaintenanceTurn& maintenance) {
  storage::VerifyOptions options;
  options.sessions.assign(request.sessions().begin(), request.sessions().end());
  const auto view = mapper.view();
  for (const SessionNumber session : options.sessions) {
    const auto known = storage::existing_session(*view, session);
    if (!known.ok()) return known.status();
    if (storage::is_deleted(*known)) return storage::no_such_session(session);
  }
  return start<v1::VerifyReply>(
      maintenance, "Admin.Verify", deadline,
      [&mapper, options](JobStream<v1::VerifyReply>& stream) { return verify_map(mapper, options, stream); });
}

Result<Producer<v1::VerifyReply>> repair_request(const v1::RepairRequest&, const Deadline&, const DaemonFacts& facts) {
  return only_without_a_daemon(facts, "repaired", "repair");
}

Result<Producer<v1::Progress>> reindex_request(const v1::ReindexRequest&, const Deadline&, const DaemonFacts& facts) {
  return only_without_a_daemon(facts, "reindexed", "reindex");
}

Result<Producer<v1::Progress>> backup(const v1::BackupRequest& request, const Deadline& deadline, map::Mapper& mapper,
                                      MaintenanceTurn& maintenance, const DaemonFacts& facts) {
  const std::string folder = request.folder();
  if (!std::filesystem::path(folder).is_absolute())
    return Status(Reason::INVALID_ARGUMENT, "'" + folder + "' is not an absolute path on the daemon's machine");
  if (facts.backup_roots.empty())
    return Status(Reason::NOT_ALLOWED, "this daemon has no folder for backups: start it with --backup-root FOLDER");
  const storage::NewFolder to(folder, facts.backup_roots);
  return start<v1::Progress>(maintenance, "Admin.Backup", deadline,
                             [&mapper, to, folder, deadline](JobStream<v1::Progress>& stream) -> Status {
                               storage::Engine& engine = mapper.engine();
                               (void)mapper.commit(deadline.at);  // if it fails, the backup has the rest in its journal
                               const std::uint64_t durable = engine.last_journal_sequence();
                               if (Status made = engine.checkpoint(to, engine_progress(stream, "backing up"));
                                   !made.ok())
                                 return made;
                               const std::uint64_t bytes = bytes_in(folder);
                               v1::Progress done = progress_of("backed up", bytes, bytes, "bytes");
                               done.mutable_backup()->set_folder(folder);
                               done.mutable_backup()->set_bytes(bytes);
                               done.mutable_backup()->set_durable_sequence(durable);
                               stream.send(std::move(done));
                               return {};
                             });
}

Result<Producer<v1::Progress>> compact(const v1::CompactRequest&, const Deadline& deadline, map::Mapper& mapper,
                                       MaintenanceTurn& maintenance) {
  return start<v1::Progress>(
      maintenance, "Admin.Compact", deadline, [&mapper, deadline](JobStream<v1::Progress>& stream) -> Status {
        storage::Engine& engine = mapper.engine();
        if (const auto committed = mapper.commit(deadline.at); !committed.ok()) return committed.status();
        const auto before = engine.stats();
        if (!before.ok()) return before.status();
        if (Status done = engine.compact(engine_progress(stream, "compacting")); !done.ok()) return done;
        const auto after = engine.stats();
        if (!after.ok()) return after.status();
        v1::Progress done = progress_of("compacted", after->map_bytes, after->map_bytes, "bytes");
        done.mutable_compact()->set_bytes_before(before->map_bytes);
        done.mutable_compact()->set_bytes_after(after->map_bytes);
        stream.send(std::move(done));
        return {};
      });
}

Result<v1::GetStatsReply> get_stats(const v1::GetStatsRequest&, const Deadline& deadline, map::Mapper& mapper,
                                    const DaemonFacts& facts, const Routes& routes, const Intake& intake,
                                    const ProcessProbe& process, const Transport& transport, const HealthProbe& health,
                                    const Metrics& metrics) {
  const auto stats = mapper.engine().stats();
  if (!stats.ok()) return stats.status();
  auto status =
      get_status(v1::GetStatusRequest(), deadline, mapper, facts, routes, intake, process, transport, health, metrics);
  if (!status.ok()) return status.status();
  v1::GetStatsReply reply;
  *reply.mutable_status() = std::move(status).value();
  reply.set_disk_bytes(stats->map_bytes + stats->journal_bytes);
  reply.set_map_bytes(stats->map_bytes);
  reply.set_blob_bytes(stats->blob_bytes);
  reply.set_garbage_bytes(stats->garbage_bytes);
  reply.set_journal_bytes(stats->journal_bytes);
  reply.set_journal_records(stats->journal_records);
  reply.set_dropped(stats->dropped);
  for (const auto& [name, value] : stats->properties) {
    v1::EngineProperty& property = *reply.add_properties();
    property.set_name(name);
    property.set_value(value);
  }
  return reply;
}

Result<v1::SetLogLevelReply> change_log_level(const v1::SetLogLevelRequest& request, const Deadline&) {
  v1::SetLogLevelReply reply;
  reply.set_former(log_level());
  if (!request.level().empty() && !set_log_level(request.level())) {
    std::string known;
    for (const std::string& level : log_levels()) known += (known.empty() ? "" : ", ") + level;
    return Status(Reason::INVALID_ARGUMENT, "there is no log level '" + request.level() + "': they are " + known);
  }
  reply.set_level(log_level());
  if (reply.level() != reply.former())
    spdlog::info("the log level is {} now, and was {}", reply.level(), reply.former());
  return reply;
}

Result<v1::CommitReply> commit(const v1::CommitRequest&, const Deadline& deadline, map::Mapper& mapper) {
  const auto applied = mapper.commit(deadline.at);
  if (!applied.ok()) return applied.status();
  v1::CommitReply reply;
  reply.set_applied_sequence(*applied);
  return reply;
}

}  // namespace relmap::rpc
