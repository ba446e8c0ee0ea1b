#include "server/rpc/edit_log.h"

#include <algorithm>
#include <chrono>
#include <memory>

#include "proto/base/mutex.h"

namespace relmap::rpc {

namespace {
constexpr std::size_t kMaxNoteBytes = 1024;
constexpr std::chrono::milliseconds kLook{100};
}  // namespace

Result<std::uint64_t> EditLog::once(const std::string& key, const std::string& content, const Deadline& deadline,
                                    const std::function<Result<std::uint64_t>()>& edit) {
  if (key.size() > kMaxKeyBytes)
    return {Reason::INVALID_ARGUMENT,
            "idempotency key of " + std::to_string(key.size()) + " bytes; at most " + std::to_string(kMaxKeyBytes)};
  const std::size_t hash = std::hash<std::string>()(content);
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
      if (found->second.content == hash) return found->second.sequence;
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
  auto sequence = edit();
  if (!sequence.ok() || key.empty()) return sequence;
  const MutexLock lock(mutex_);
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
