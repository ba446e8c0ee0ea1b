// The files by which the daemon proves who it is over TLS, and by which it knows its callers.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::rpc {

// Files in PEM, which are read again within ten seconds after they change.
struct TlsFiles {
  std::string certificate, key;  // may be one file, so that both change at a time; empty: no TLS
  std::string client_authority;  // by whom callers' certificates must be signed; empty: none is asked for
};

// BAD_CONFIG unless the files can be read and belong together; nothing is checked without TLS.
Status check_files(const TlsFiles& files);

// What an operator has to know of them at this time (UTC, seconds since 1970): the same, and BAD_CONFIG if the
// certificate has expired, so that nobody can call over TLS, or will within two weeks.
Status tls_state(const TlsFiles& files, std::int64_t utc_s);

// Keeps that state, so that nobody who asks for it waits for a disk. Thread-safe.
class TlsWatch {
 public:
  explicit TlsWatch(TlsFiles files) : files_(std::move(files)) {}
  // Reads the files.
  Status look(std::int64_t utc_s);
  // As of the last look(); ok before the first.
  Status state() const;

 private:
  const TlsFiles files_;
  mutable Mutex mutex_;
  Status state_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::rpc
