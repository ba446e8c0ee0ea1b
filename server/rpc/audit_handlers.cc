#include <algorithm>

#include "proto/wire/convert.h"
#include "relmap/v1/admin.pb.h"
#include "server/rpc/audit_log.h"
#include "server/rpc/charge.h"
#include "server/rpc/handlers.h"

namespace relmap::rpc {

namespace {

constexpr std::uint32_t kEntriesPerPage = 100, kMaxEntriesPerPage = 1000;

v1::AuditEntry audit_message(const AuditRead& entry) {
  v1::AuditEntry message;
  message.set_time_us(entry.time_us);
  message.set_who(entry.who);
  message.set_role(entry.role);
  message.set_from(entry.from);
  message.set_method(entry.method);
  message.set_request(entry.request);
  message.set_request_id(entry.request_id);
  message.set_outcome(to_wire(entry.outcome));
  message.set_message(entry.message);
  message.set_seconds(entry.seconds);
  message.set_trace_id(entry.trace_id);
  return message;
}

}  // namespace

Result<v1::ListAuditReply> list_audit(const v1::ListAuditRequest& request, const Deadline& deadline,
                                      map::Mapper& mapper, const Audit& audit) {
  if (!audit.log)
    return {Reason::UNSUPPORTED,
            "this daemon keeps no audit log (`audit` in its configuration, or its file cannot be "
            "written; its log says which)"};
  if (request.from_us() < 0 || request.until_us() < 0 ||
      (request.until_us() != 0 && request.until_us() <= request.from_us()))
    return {Reason::INVALID_ARGUMENT, "the times must be 0 or more, and until_us later than from_us"};
  // The page as it is read and as it is sent, and the blocks of a file.
  Charge charge(mapper.budget(), storage::Share::kReplies);
  if (Status charged = charge.grow_to(2 * kMaxAuditEntryBytesPerPage + (256u << 10)); !charged.ok()) return charged;
  AuditQuery query;
  query.from_us = request.from_us();
  query.until_us = request.until_us();
  query.who = request.who();
  query.method = request.method();
  query.failed = request.failed();
  query.max_entries = request.page_size() == 0 ? kEntriesPerPage : std::min(request.page_size(), kMaxEntriesPerPage);
  query.token = request.page_token();
  const auto page = audit.log->read(query, [&] { return deadline.check(); });
  if (!page.ok()) return page.status();
  v1::ListAuditReply reply;
  for (const AuditRead& entry : page->entries) *reply.add_entries() = audit_message(entry);
  reply.set_next_page_token(page->next);
  reply.set_unreadable(page->unreadable);
  return reply;
}

}  // namespace relmap::rpc
