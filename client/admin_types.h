// The results of an operator's calls, as plain values.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "client/map_types.h"

namespace relmap::client {

struct Progress {
  std::string step;
  std::uint64_t done = 0, total = 0;  // total 0: not known
  std::string unit;                   // of done and total: "frames", "bytes"
};
// Called several times a second during long work; returning false ends the work.
using OnProgress = std::function<bool(const Progress&)>;

struct Finding {
  Reason reason = Reason::OK;
  FrameId frame;  // session 0: the finding is not about one frame
  std::string message;
};

struct VerifySummary {
  std::uint64_t sessions = 0, frames = 0, edges = 0, landmarks = 0, observations = 0, features = 0;
  std::uint64_t journal_records = 0;
  std::uint64_t findings = 0;
};

struct Backup {
  std::string folder;
  std::uint64_t bytes = 0;
  std::uint64_t durable_sequence = 0;  // the backup contains the journal up to and including this sequence
};

struct Compaction {  // bytes on disk
  std::uint64_t bytes_before = 0, bytes_after = 0;
};

struct StoreStats {
  // On disk. blob_bytes are part of map_bytes, and garbage_bytes, which compact() frees, part of blob_bytes.
  std::uint64_t map_bytes = 0, blob_bytes = 0, garbage_bytes = 0;
  std::uint64_t journal_bytes = 0, journal_records = 0;
  std::string dropped;  // what the daemon cut off the journal when it started, in words
  std::vector<std::pair<std::string, std::string>> properties;
  DaemonStatus status;
};

// What entries of the audit log are listed. All conditions must hold.
struct AuditFilter {
  std::int64_t from_us = 0, until_us = 0;  // at the first time or later, and before the second, UTC; 0: any
  std::string who = {};                    // of this caller; empty: of all
  std::string method = {};                 // such as "Map.SetEdgeState"; empty: all
  bool failed = false;                     // only what did not succeed
  std::size_t limit = 100;                 // at most so many, the newest; 0: all
};

// What an operator did or tried.
struct AuditEntry {
  std::int64_t time_us = 0;  // UTC
  std::string who;           // the name in the credentials; empty: the caller was not known
  std::string role;
  std::string from;  // the caller's address
  std::string method;
  std::string request;  // in protobuf's text format; a long one is cut off
  std::string request_id;
  Status outcome;      // not ok: why it failed
  double seconds = 0;  // that it took
  std::string trace_id;
};
struct AuditLog {
  std::vector<AuditEntry> entries;  // the newest first
  std::uint64_t unreadable = 0;     // lines that were left out, since they are no entries
};

}  // namespace relmap::client
