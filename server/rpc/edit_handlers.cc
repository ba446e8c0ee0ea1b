#include <algorithm>
#include <chrono>

#include "proto/wire/convert.h"
#include "relmap/v1/admin.pb.h"
#include "server/map/operator_edit.h"
#include "server/rpc/edit_log.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"

namespace relmap::rpc {

namespace {

constexpr std::chrono::milliseconds kTellEach{100};  // between messages of the progress of a deletion

}  // namespace

Result<v1::SetLabelReply> set_label(const v1::SetLabelRequest& request, const Deadline& deadline, map::Mapper& mapper,
                                    EditLog& edits) {
  storage::SetLabelRecord record{{}, request.label(), !request.remove()};
  if (Status valid = map::check_label(record); !valid.ok()) return valid;
  const auto frame = existing_frame(*mapper.view(), request.has_frame(), request.frame(), "frame");
  if (!frame.ok()) return frame.status();
  record.frame = *frame;
  std::uint64_t sequence = 0;
  const Status status = write_and_wait(
      mapper, edits, request.idempotency_key(), request.SerializeAsString(), deadline,
      [&]() -> Result<storage::JournalRecord> {
        if (Status possible = map::check_label_edit(*mapper.view(), record); !possible.ok()) return possible;
        return storage::JournalRecord(record);
      },
      sequence);
  if (!status.ok()) return status;

  const auto view = mapper.view();
  v1::SetLabelReply reply;
  if (const auto hot = view->hot(*frame))
    for (const std::string& label : hot->labels) reply.add_labels(label);
  reply.set_journal_sequence(sequence);
  reply.set_map_version(view->version());
  return reply;
}

Result<v1::FreezeSessionReply> freeze_session(const v1::FreezeSessionRequest& request, const Deadline& deadline,
                                              map::Mapper& mapper, EditLog& edits) {
  std::uint64_t sequence = 0;
  const Status status = write_and_wait(
      mapper, edits, request.idempotency_key(), request.SerializeAsString(), deadline,
      [&]() -> Result<storage::JournalRecord> {
        auto record = map::freezing(*mapper.view(), request.session(), request.frozen());
        if (!record.ok()) return record.status();
        return storage::JournalRecord(std::move(record).value());
      },
      sequence);
  if (!status.ok()) return status;
  v1::FreezeSessionReply reply;
  reply.set_map_version(mapper.view()->version());
  return reply;
}

Result<Producer<v1::Progress>> delete_session(const v1::DeleteSessionRequest& request, const Deadline& deadline,
                                              map::Mapper& mapper, EditLog& edits) {
  const SessionNumber number = request.session();
  std::uint64_t sequence = 0;
  const auto before = map::session_to_delete(*mapper.view(), number, request.uuid());
  if (!before.ok()) return before.status();
  if (!storage::is_going(*before)) {
    const Status status = write_and_wait(
        mapper, edits, request.idempotency_key(), request.SerializeAsString(), deadline,
        [&] {
          return storage::JournalRecord(storage::SetSessionStateRecord{number, storage::SessionState::kDeleting});
        },
        sequence);
    if (!status.ok()) return status;
  }
  const std::uint64_t total = before->frames;
  return Producer<v1::Progress>(
      [&mapper, number, total, deadline, ended = false]() mutable -> Result<std::optional<v1::Progress>> {
        if (ended) return std::optional<v1::Progress>();
        if (Status status = deadline.check(); !status.ok()) return status;
        const auto left = mapper.wait_deleted(number, std::chrono::steady_clock::now() + kTellEach);
        if (!left.ok()) return left.status();
        ended = *left == 0;
        v1::Progress progress;
        progress.set_step("deleting");
        progress.set_total(total);
        progress.set_done(total - std::min(*left, total));
        progress.set_unit("frames");
        return std::optional<v1::Progress>(std::move(progress));
      });
}

}  // namespace relmap::rpc
