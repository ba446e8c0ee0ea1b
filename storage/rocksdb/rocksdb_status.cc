#include "storage/rocksdb/rocksdb_status.h"

#include <string>

namespace relmap {

Status converted(const rocksdb::Status& status, const char* what) {
  if (status.ok()) return {};
  const Reason reason = status.IsCorruption() ? Reason::DATA_LOSS : Reason::IO_ERROR;
  return Status(reason, std::string(what) + ": " + status.ToString());
}

}  // namespace relmap
