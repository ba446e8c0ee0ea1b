// The audit log: who changed the map or looked after it, from where, with what request and outcome. One JSON object a
// line. Refused attempts are in it, too.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "proto/base/mutex.h"
#include "proto/base/status.h"

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

  // Opens the file for appending, for its owner only. IO_ERROR.
  static Result<std::unique_ptr<AuditLog>> open(const std::string& file, std::uint64_t file_bytes = kFileBytes);
  ~AuditLog();

  struct Entry {
    std::string who, role;  // empty if the caller is not known
    std::string from;       // its address
    std::string method, request, request_id;
    Status outcome;
    std::chrono::microseconds took{0};
  };
  // Keys: time (RFC 3339, UTC, with milliseconds), who, role, from, method, request, request_id, outcome (a reason),
  // message, seconds. A failure to write is logged, and the call goes on.
  void write(const Entry& entry);

  // The request in protobuf's text format on one line, cut off at kMaxRequest; of a large one only its size.
  static std::string text_of(const google::protobuf::Message& request);

 private:
  AuditLog(std::string file, std::uint64_t file_bytes) : file_(std::move(file)), file_bytes_(file_bytes) {}
  Status reopen() RELMAP_REQUIRES(mutex_);
  void rotate() RELMAP_REQUIRES(mutex_);

  const std::string file_;
  const std::uint64_t file_bytes_;
  Mutex mutex_;
  int descriptor_ RELMAP_GUARDED_BY(mutex_) = -1;
  std::uint64_t written_ RELMAP_GUARDED_BY(mutex_) = 0;
  bool failing_ RELMAP_GUARDED_BY(mutex_) = false;  // told once
};

}  // namespace relmap::rpc
