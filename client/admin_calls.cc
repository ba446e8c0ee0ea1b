#include <algorithm>

#include "client/client_impl.h"
#include "client/replies.h"
#include "proto/wire/convert.h"

namespace relmap::client {

namespace {

Progress read_progress(const v1::Progress& message) {
  return {message.step(), message.done(), message.total(), message.unit()};
}

Finding read_finding(const v1::Finding& message) {
  return {reason_from_wire(message.reason()), read_id(message.frame()), message.message()};
}

// Reads a stream to its end, or until `take` returns false.
template <typename Impl, typename Reply, typename Take>
Status read_all(const Impl& impl, grpc::ClientContext& context, grpc::ClientReader<Reply>& stream, Take take) {
  Reply reply;
  bool wanted = true;
  while (wanted && stream.Read(&reply)) wanted = take(reply);
  if (!wanted) context.TryCancel();
  const Status end = impl.end_of(stream.Finish());
  return wanted ? end : Status(Reason::DEADLINE, "interrupted");
}

}  // namespace

Result<VerifySummary> Client::verify(const std::vector<SessionNumber>& sessions,
                                     const std::function<void(const Finding&)>& on_finding,
                                     const OnProgress& on_progress) {
  v1::VerifyRequest request;
  for (const SessionNumber session : sessions) request.add_sessions(session);
  grpc::ClientContext context;
  const auto cancelled = impl_->begin(context, impl_->deadline());
  const auto stream = impl_->admin->Verify(&context, request);
  VerifySummary summary;
  const Status end = read_all(*impl_, context, *stream, [&](const v1::VerifyReply& reply) {
    impl_->tell(reply);
    for (const v1::Finding& finding : reply.findings()) on_finding(read_finding(finding));
    if (reply.has_summary()) {
      const v1::VerifySummary& s = reply.summary();
      summary = {s.sessions(),     s.frames(),   s.edges(),           s.landmarks(),
                 s.observations(), s.features(), s.journal_records(), s.findings()};
    }
    return on_progress(read_progress(reply.progress()));
  });
  if (!end.ok()) return end;
  return summary;
}

Result<Backup> Client::backup(const std::string& folder, const OnProgress& on_progress) {
  v1::BackupRequest request;
  request.set_folder(folder);
  if (Status texts = check_texts(request); !texts.ok()) return texts;
  grpc::ClientContext context;
  const auto cancelled = impl_->begin(context, impl_->deadline());
  const auto stream = impl_->admin->Backup(&context, request);
  Backup backup;
  const Status end = read_all(*impl_, context, *stream, [&](const v1::Progress& reply) {
    impl_->tell(reply);
    if (reply.has_backup())
      backup = {reply.backup().folder(), reply.backup().bytes(), reply.backup().durable_sequence()};
    return on_progress(read_progress(reply));
  });
  if (!end.ok()) return end;
  return backup;
}

Result<Compaction> Client::compact(const OnProgress& on_progress) {
  grpc::ClientContext context;
  const auto cancelled = impl_->begin(context, impl_->deadline());
  const auto stream = impl_->admin->Compact(&context, v1::CompactRequest());
  Compaction compaction;
  const Status end = read_all(*impl_, context, *stream, [&](const v1::Progress& reply) {
    impl_->tell(reply);
    if (reply.has_compact()) compaction = {reply.compact().bytes_before(), reply.compact().bytes_after()};
    return on_progress(read_progress(reply));
  });
  if (!end.ok()) return end;
  return compaction;
}

Result<StoreStats> Client::stats() {
  v1::GetStatsReply reply;
  const Status status =
      impl_->ask(*impl_->admin, &v1::Admin::Stub::GetStats, v1::GetStatsRequest(), reply, impl_->deadline());
  if (!status.ok()) return status;
  StoreStats stats;
  stats.map_bytes = reply.map_bytes();
  stats.blob_bytes = reply.blob_bytes();
  stats.garbage_bytes = reply.garbage_bytes();
  stats.journal_bytes = reply.journal_bytes();
  stats.journal_records = reply.journal_records();
  stats.dropped = reply.dropped();
  for (const v1::EngineProperty& property : reply.properties())
    stats.properties.emplace_back(property.name(), property.value());
  stats.status = read_status(reply.status());
  return stats;
}

Result<AuditLog> Client::audit(const AuditFilter& filter) {
  constexpr std::size_t kMaxPage = 1000;
  v1::ListAuditRequest request;
  request.set_from_us(filter.from_us);
  request.set_until_us(filter.until_us);
  request.set_who(filter.who);
  request.set_method(filter.method);
  request.set_failed(filter.failed);
  request.set_page_size(static_cast<std::uint32_t>(filter.limit == 0 ? kMaxPage : std::min(filter.limit, kMaxPage)));
  AuditLog log;
  const auto is_full = [&] { return filter.limit > 0 && log.entries.size() >= filter.limit; };
  const Status status = impl_->list_until<v1::ListAuditReply>(*impl_->admin, &v1::Admin::Stub::ListAudit, request,
                                                              [&](const v1::ListAuditReply& page) -> Result<bool> {
                                                                log.unreadable += page.unreadable();
                                                                for (const v1::AuditEntry& message : page.entries())
                                                                  if (!is_full())
                                                                    log.entries.push_back(read_audit(message));
                                                                return !is_full();
                                                              });
  if (!status.ok()) return status;
  return log;
}

Result<std::string> Client::set_log_level(const std::string& level) {
  v1::SetLogLevelRequest request;
  request.set_level(level);
  v1::SetLogLevelReply reply;
  const Status status = impl_->ask(*impl_->admin, &v1::Admin::Stub::SetLogLevel, request, reply, impl_->deadline());
  if (!status.ok()) return status;
  return reply.former();
}

Status Client::freeze_session(SessionNumber session, bool frozen) {
  v1::FreezeSessionRequest request;
  request.set_session(session);
  request.set_frozen(frozen);
  request.set_idempotency_key(SessionUuid::random().to_string());
  v1::FreezeSessionReply reply;
  return impl_->ask(*impl_->admin, &v1::Admin::Stub::FreezeSession, request, reply, impl_->deadline());
}

Status Client::delete_session(SessionNumber session, const std::string& uuid, const OnProgress& on_progress) {
  v1::DeleteSessionRequest request;
  request.set_session(session);
  request.set_uuid(uuid);
  if (Status texts = check_texts(request); !texts.ok()) return texts;
  grpc::ClientContext context;
  const auto cancelled = impl_->begin(context, impl_->deadline());
  const auto stream = impl_->admin->DeleteSession(&context, request);
  return read_all(*impl_, context, *stream, [&](const v1::Progress& reply) {
    impl_->tell(reply);
    return on_progress(read_progress(reply));
  });
}

Result<std::uint64_t> Client::commit() {
  v1::CommitReply reply;
  const Status status =
      impl_->ask(*impl_->admin, &v1::Admin::Stub::Commit, v1::CommitRequest(), reply, impl_->deadline());
  if (!status.ok()) return status;
  return reply.applied_sequence();
}

}  // namespace relmap::client
