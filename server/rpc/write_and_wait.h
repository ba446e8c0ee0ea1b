// Makes an edit durable, and waits until it is applied and visible.
#pragma once

#include <functional>
#include <string>

#include "server/map/mapper.h"
#include "server/rpc/deadline.h"
#include "server/rpc/edit_log.h"

namespace relmap::rpc {

// Calls `make_record` unless the edit with this key and content was done before, and sets `sequence` to that of the
// journal record. The reasons are those of `make_record`, EditLog::once(), Mapper::submit() and wait_applied().
Status write_and_wait(map::Mapper& mapper, EditLog& edits, const std::string& key, const std::string& content,
                      const Deadline& deadline, const std::function<Result<storage::JournalRecord>()>& make_record,
                      std::uint64_t& sequence);

// INVALID_ARGUMENT if the note is too long.
Status check_note(const std::string& note);

}  // namespace relmap::rpc
