#include "storage/rocksdb/rocksdb_status.h"

#include <cerrno>
#include <cstring>
#include <string>

namespace relmap::storage {

namespace {

// RocksDB keeps the system's own words.
bool says(const rocksdb::Status& status, int error) {
  return status.ToString().find(std::strerror(error)) != std::string::npos;
}

Reason reason_of(const rocksdb::Status& status) {
  if (status.IsCorruption()) return Reason::DATA_LOSS;
  if (status.IsNoSpace() || says(status, ENOSPC) || says(status, EDQUOT)) return Reason::DISK_FULL;
  if (says(status, EROFS)) return Reason::READ_ONLY;
  if (says(status, EMFILE) || says(status, ENFILE)) return Reason::TOO_MANY_FILES;
  return Reason::IO_ERROR;
}

}  // namespace

Status converted(const rocksdb::Status& status, const char* what) {
  return status.ok() ? Status() : Status(reason_of(status), std::string(what) + ": " + status.ToString());
}

}  // namespace relmap::storage
