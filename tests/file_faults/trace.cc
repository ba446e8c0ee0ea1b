#include "tests/file_faults/trace.h"

#include <fcntl.h>

#include <array>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace relmap::testing {

std::vector<FileOperation> read_trace(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  const std::string all = text.str();
  std::vector<FileOperation> operations;
  std::size_t at = 0;
  const auto take = [&](std::uint64_t size) {
    if (size > all.size() - at) throw std::runtime_error(file + " is cut off");
    at += size;
    return all.substr(at - size, size);
  };
  while (at < all.size()) {
    TraceHeader header;
    std::memcpy(&header, take(sizeof header).data(), sizeof header);
    FileOperation operation{header.kind,   header.fd, header.flags, take(header.path), take(header.other),
                            header.offset, {}};
    operation.bytes = take(header.bytes);
    operations.push_back(std::move(operation));
  }
  return operations;
}

bool changes_disk(const FileOperation& operation) {
  switch (operation.kind) {
    case OperationKind::kOpen:
      return (operation.flags & (O_CREAT | O_TRUNC)) != 0;
    case OperationKind::kClose:
    case OperationKind::kDuplicate:
      return false;
    default:
      return true;
  }
}

std::string to_string(const FileOperation& operation) {
  constexpr std::array kNames{"open", "close",       "duplicate", "write", "resize", "resize",     "extend",
                              "sync", "failed sync", "rename",    "link",  "remove", "make folder"};
  std::string text = kNames.at(static_cast<std::size_t>(operation.kind));
  if (operation.fd >= 0) text += " " + std::to_string(operation.fd);
  if (!operation.path.empty()) text += " " + operation.path;
  if (!operation.other.empty()) text += " to " + operation.other;
  if (operation.kind == OperationKind::kWrite)
    text += " " + std::to_string(operation.offset) + "+" + std::to_string(operation.bytes.size());
  return text;
}

}  // namespace relmap::testing
