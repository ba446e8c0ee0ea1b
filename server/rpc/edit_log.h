// Makes edits durable and visible, and idempotent by their keys: an edit that is sent again with the same key is done
// only once.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>

#include "proto/base/mutex.h"
#include "server/map/mapper.h"
#include "server/rpc/deadline.h"

namespace relmap::rpc {

// Thread-safe. Remembers the last storage::kRememberedEdits edits with a key.
class EditLog {
 public:
  // `before`: those that the map remembers from before this run of the daemon, by sequence.
  explicit EditLog(const std::map<std::uint64_t, storage::EditKey>& before = {});

  // Runs `edit`, which returns its journal sequence, unless an edit with this key was done already; then returns that
  // one's sequence. `edit` writes the key with its record, so that the map remembers it too. Edits run one at a time.
  // INVALID_ARGUMENT if the key is too long or was used for another `content`; DEADLINE.
  Result<std::uint64_t> once(const std::string& key, const std::string& content, const Deadline& deadline,
                             const std::function<Result<std::uint64_t>(const storage::EditKey& named)>& edit);

 private:
  struct Done {
    std::uint64_t content = 0;  // hash
    std::uint64_t sequence = 0;
  };
  void remember(const storage::EditKey& edit, std::uint64_t sequence) RELMAP_REQUIRES(mutex_);

  Mutex mutex_;
  ConditionVariable ended_;
  bool running_ RELMAP_GUARDED_BY(mutex_) = false;  // an edit, without the mutex
  std::unordered_map<std::string, Done> done_ RELMAP_GUARDED_BY(mutex_);
  std::deque<std::string> order_ RELMAP_GUARDED_BY(mutex_);
};

// Makes an edit durable as the caller's, and waits until it is applied and visible. Calls `make_record` unless the edit
// with this key and content was done before, and sets `sequence` to that of the journal record. The reasons are those
// of `make_record`, EditLog::once(), Mapper::submit() and wait_applied().
Status write_and_wait(map::Mapper& mapper, EditLog& edits, const std::string& key, const std::string& content,
                      const Deadline& deadline, const std::function<Result<storage::JournalRecord>()>& make_record,
                      std::uint64_t& sequence);

// INVALID_ARGUMENT if the note is too long.
Status check_note(const std::string& note);

}  // namespace relmap::rpc
