// What a program did to the files below a folder, in order, as interposer.cc recorded it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/file_faults/control.h"

namespace relmap::testing {

struct FileOperation {
  OperationKind kind = OperationKind::kOpen;
  int fd = -1, flags = 0;
  std::string path, other;  // relative to the root; "" is the root
  std::uint64_t offset = 0;
  std::string bytes;
};

// Throws std::runtime_error.
std::vector<FileOperation> read_trace(const std::string& file);

// Whether a power failure after this operation can leave something else than one before it.
bool changes_disk(const FileOperation& operation);

// For people: "write map/CURRENT 0+16".
std::string to_string(const FileOperation& operation);

}  // namespace relmap::testing
