#include "server/rpc/edit_log.h"

#include <algorithm>
#include <chrono>
#include <memory>

#include "proto/base/crc32c.h"
#include "proto/base/mutex.h"
#include "proto/base/names.h"
#include "server/rpc/request_context.h"

namespace relmap::rpc {

namespace {
constexpr std::size_t kMaxNoteBytes = 1024;
constexpr std::chrono::milliseconds kLook{100};

// The same in every version and on every machine, since the map keeps it.
std::uint64_t hash_of(const std::string& content) {
  return (std::uint64_t{content.size()} << 32) | crc32c(as_bytes(content));
}
}  // namespace

EditLog::EditLog(const std::map<std::uint64_t, storage::EditKey>& before) {
  const MutexLock lock(mutex_);
  for (const auto& [sequence, edit] : before) remember(edit, sequence);
}

void EditLog::remember(const storage::EditKey& edit, std::uint64_t sequence) {
  if (!done_.insert_or_assign(edit.key, Done{edit.content, sequence}).second) return;
  order_.push_back(edit.key);
  if (order_.size() <= storage::kRememberedEdits) return;
  done_.erase(order_.front());
  order_.pop_front();
}

Result<std::uint64_t> EditLog::once(const std::string& key, const std::string& content, const Deadline& deadline,
                                    const std::function<Result<std::uint64_t>(const storage::EditKey&)>& edit) {
  if (key.size() > storage::kMaxEditKeyBytes)
    return {Reason::INVALID_ARGUMENT, "idempotency key of " + std::to_string(key.size()) + " bytes; at most " +
                                          std::to_string(storage::kMaxEditKeyBytes)};
  const storage::EditKey named{key, hash_of(content)};
  {
    const MutexLock lock(mutex_);
    // The turn may be long in coming: another edit may wait for a disk that does not answer.
    while (running_) {
      if (Status going = deadline.check(); !going.ok())
        return {going.reason(), "another edit is still running; " + going.message()};
      ended_.wait_until(mutex_, std::min(deadline.at, std::chrono::steady_clock::now() + kLook));
    }
    const auto found = key.empty() ? done_.end() : done_.find(key);
    if (found != done_.end()) {
      if (found->second.content == named.content) return found->second.sequence;
      return {Reason::INVALID_ARGUMENT, "idempotency key '" + key + "' was used for another edit"};
    }
    running_ = true;
  }
  // Ends the turn also if the edit throws, and otherwise only once the edit is remembered.
  const std::shared_ptr<const void> turn(this, [this](const void*) {
    const MutexLock lock(mutex_);
    running_ = false;
    ended_.notify_all();  // one that finds its edit done passes the turn to nobody
  });
  auto sequence = edit(named);
  if (!sequence.ok() || key.empty()) return sequence;
  const MutexLock lock(mutex_);
  remember(named, *sequence);
  return sequence;
}

Status write_and_wait(map::Mapper& mapper, EditLog& edits, const std::string& key, const std::string& content,
                      const Deadline& deadline, const std::function<Result<storage::JournalRecord>()>& make_record,
                      std::uint64_t& sequence) {
  const auto written = edits.once(key, content, deadline, [&](const storage::EditKey& named) -> Result<std::uint64_t> {
    auto record = make_record();
    if (!record.ok()) return record.status();
    *storage::edit_key(*record) = named;
    storage::submission(*record)->author = current_author();
    return mapper.submit_and_wait(std::move(record).value());
  });
  if (!written.ok()) return written.status();
  sequence = *written;
  return mapper.wait_applied(sequence, deadline.at);
}

Status check_note(const std::string& note) {
  const Status line = check_line("a note", note, kMaxNoteBytes);
  return line.ok() ? Status() : Status(Reason::INVALID_ARGUMENT, line.message());
}

}  // namespace relmap::rpc
