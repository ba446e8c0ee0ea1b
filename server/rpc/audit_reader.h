// Reads the files of an audit log page by page, the newest entry first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "storage/io/file.h"

namespace relmap::rpc {

struct AuditQuery {
  std::int64_t from_us = 0, until_us = 0;  // UTC; entries of `from_us` or later, and before `until_us`; 0: any
  std::string who, method;                 // empty: of all
  bool failed = false;                     // only what did not succeed
  std::size_t max_entries = 100;
  std::string token;  // AuditPage::next of the page before; empty: begin with the newest
};

// An entry as it was written (audit_log.h).
struct AuditRead {
  std::int64_t time_us = 0;  // UTC
  std::string who, role, from, method, request, request_id;
  Reason outcome = Reason::OK;
  std::string message;
  double seconds = 0;
  std::string trace_id;
};

struct AuditPage {
  std::vector<AuditRead> entries;
  std::string next;              // empty: this is the last page
  std::uint64_t unreadable = 0;  // lines that are no entries, such as one that was torn; they are left out
};

// A page ends early, even without entries, after so many bytes of the log, so that each call takes a fraction of a
// second, however little of the log matches; and after so many bytes of entries.
inline constexpr std::uint64_t kMaxAuditBytesPerPage = std::uint64_t{16} << 20;
inline constexpr std::size_t kMaxAuditEntryBytesPerPage = std::size_t{1} << 20;

// Reads the next page. `files` are those of the log, newest first, as they are now; a token tells where its page begins
// by what a file begins with, and so holds while files are moved on and written to. Files that hold nothing of the time
// that is asked for are not read. Memory: one block of a file and the page. INVALID_ARGUMENT (the token is none of this
// log), VIEW_EXPIRED (its file was deleted since), IO_ERROR, and what `proceed` returns.
Result<AuditPage> read_audit(const std::vector<std::unique_ptr<storage::ReadFile>>& files, const AuditQuery& query,
                             const std::function<Status()>& proceed, std::uint64_t max_bytes = kMaxAuditBytesPerPage);

}  // namespace relmap::rpc
