// One edit of a caller: durable, then applied and visible.
#pragma once

#include <functional>
#include <string>

#include "server/map/mapper.h"
#include "server/rpc/deadline.h"
#include "server/rpc/edit_log.h"

namespace relmap::rpc {

// `make_record` is asked unless the edit of this key and content was done before. `sequence`: of its journal record.
// What `make_record` refuses with, EditLog::once(), Mapper::submit() and wait_applied().
Status write_and_wait(map::Mapper& mapper, EditLog& edits, const std::string& key, const std::string& content,
                      const Deadline& deadline, const std::function<Result<storage::JournalRecord>()>& make_record,
                      std::uint64_t& sequence);

// INVALID_ARGUMENT
Status check_note(const std::string& note);

}  // namespace relmap::rpc
