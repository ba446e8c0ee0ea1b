#include "server/rpc/edit_log.h"

namespace relmap::rpc {

namespace {
constexpr std::size_t kMaxNoteBytes = 1024;
}  // namespace

Result<std::uint64_t> EditLog::once(const std::string& key, const std::string& content, const Deadline& deadline,
                                    const std::function<Result<std::uint64_t>()>& edit) {
  if (key.size() > kMaxKeyBytes)
    return {Reason::INVALID_ARGUMENT,
            "idempotency key of " + std::to_string(key.size()) + " bytes; at most " + std::to_string(kMaxKeyBytes)};
  const std::unique_lock lock(mutex_, deadline.at);
  if (!lock.owns_lock()) return {Reason::DEADLINE, "another edit is still running"};
  const std::size_t hash = std::hash<std::string>()(content);
  if (!key.empty()) {
    const auto found = done_.find(key);
    if (found != done_.end()) {
      if (found->second.content == hash) return found->second.sequence;
      return {Reason::INVALID_ARGUMENT, "idempotency key '" + key + "' was used for another edit"};
    }
  }
  auto sequence = edit();
  if (!sequence.ok() || key.empty()) return sequence;
  done_.emplace(key, Done{hash, *sequence});
  order_.push_back(key);
  if (order_.size() > kKept) {
    done_.erase(order_.front());
    order_.pop_front();
  }
  return sequence;
}

Status write_and_wait(map::Mapper& mapper, EditLog& edits, const std::string& key, const std::string& content,
                      const Deadline& deadline, const std::function<Result<storage::JournalRecord>()>& make_record,
                      std::uint64_t& sequence) {
  const auto written = edits.once(key, content, deadline, [&]() -> Result<std::uint64_t> {
    auto record = make_record();
    if (!record.ok()) return record.status();
    return mapper.submit_and_wait(std::move(record).value());
  });
  if (!written.ok()) return written.status();
  sequence = *written;
  return mapper.wait_applied(sequence, deadline.at);
}

Status check_note(const std::string& note) {
  if (note.size() <= kMaxNoteBytes) return {};
  return {Reason::INVALID_ARGUMENT,
          "a note of " + std::to_string(note.size()) + " bytes; at most " + std::to_string(kMaxNoteBytes)};
}

}  // namespace relmap::rpc
