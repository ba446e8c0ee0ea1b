// The audit log: who changed the map or looked after it, from where, with what request and outcome. One JSON object a
// line. Refused attempts are in it, too. A thread of its own writes, so that no call waits for the disk.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "proto/base/mutex.h"
#include "proto/base/status.h"
#include "server/rpc/audit_reader.h"

namespace google::protobuf {
class Message;
}

namespace relmap::rpc {

// Thread-safe.
class AuditLog {
 public:
  static constexpr std::uint64_t kFileBytes = std::uint64_t{16} << 20;  // then FILE becomes FILE.1, FILE.1 FILE.2, ...
  static constexpr int kOldFiles = 8;                                   // those before are deleted
  static constexpr std::size_t kMaxRequest = 2048;                      // bytes of a request's text
  // So many calls of one caller that fail within a minute have lines of their own; of the others their number is
  // written, so that nobody can push out what others did by trying again and again.
  static constexpr int kFailuresListed = 60;

  // Opens the file for appending, for its owner only. IO_ERROR.
  static Result<std::unique_ptr<AuditLog>> open(const std::string& file, std::uint64_t file_bytes = kFileBytes);
  // Writes what it was told before.
  ~AuditLog();
  AuditLog(const AuditLog&) = delete;
  AuditLog& operator=(const AuditLog&) = delete;

  struct Entry {
    std::string who, role;  // empty if the caller is not known
    std::string from;       // its address
    std::string method, request, request_id;
    Status outcome;
    std::chrono::microseconds took{0};
    std::string trace_id = {};  // of the caller's traceparent; empty: none
  };
  // Keys: time (RFC 3339, UTC, with milliseconds), who, role, from, method, request, request_id, outcome (a reason),
  // message, seconds, and trace_id if there is one. Returns at once. A failure to write is logged; where the disk takes
  // too little for too long, lines are lost, and their number is written.
  void write(const Entry& entry);
  // Waits until everything is written, or until this time. False: something is not written yet.
  bool flush(std::chrono::steady_clock::time_point until = std::chrono::steady_clock::time_point::max());

  // Reads a page of what is written (audit_reader.h), after a flush() of a second at most. The files are not moved on
  // while they are opened, and a page holds on to those that it has.
  Result<AuditPage> read(const AuditQuery& query, const std::function<Status()>& proceed);

  // The request in protobuf's text format on one line, cut off at kMaxRequest; of a large one only its size.
  static std::string text_of(const google::protobuf::Message& request);

 private:
  using Clock = std::chrono::steady_clock;
  // The calls of one caller that failed within a minute.
  struct Failures {
    Clock::time_point since;
    int listed = 0;
    std::uint64_t unlisted = 0;
    Entry last;  // of these
  };

  AuditLog(std::string file, std::uint64_t file_bytes) : file_(std::move(file)), file_bytes_(file_bytes) {}
  bool lists(const Entry& entry) RELMAP_REQUIRES(mutex_);
  void sum_up(Clock::time_point until) RELMAP_REQUIRES(mutex_);
  void queue(std::string line) RELMAP_REQUIRES(mutex_);
  void run();
  // Of the thread, but for the first reopen().
  void put(const std::string& line);
  Status reopen();
  void rotate() RELMAP_REQUIRES(files_);
  std::string old_file(int number) const { return file_ + "." + std::to_string(number); }

  const std::string file_;
  const std::uint64_t file_bytes_;
  int descriptor_ = -1;
  std::uint64_t written_ = 0;
  bool failing_ = false;  // told once
  bool torn_ = false;     // the last line was not written to its end

  Mutex files_;  // held while files are moved on, or opened to be read
  Mutex mutex_;
  ConditionVariable changed_;
  std::map<std::string, Failures> failures_ RELMAP_GUARDED_BY(mutex_);  // by caller
  std::deque<std::string> lines_ RELMAP_GUARDED_BY(mutex_);             // that are not written yet
  std::uint64_t lost_ RELMAP_GUARDED_BY(mutex_) = 0;                    // lines for which there was no room
  bool writing_ RELMAP_GUARDED_BY(mutex_) = false;
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace relmap::rpc
