// What a test and the library that it puts under a program (interposer.cc) tell each other, in a file that both map.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace relmap::testing {

// Names of environment variables: the folder whose files are watched, which must be canonical; the file of a
// FaultControl; the file that the operations are recorded in, none if it is not set.
inline constexpr const char* kFaultRoot = "RELMAP_FILE_FAULTS_ROOT";
inline constexpr const char* kFaultControl = "RELMAP_FILE_FAULTS_CONTROL";
inline constexpr const char* kFaultTrace = "RELMAP_FILE_FAULTS_TRACE";

// What can be made to fail. An allocation is one that the program itself asks for, not a library.
enum class FaultKind : std::uint32_t { kOpen, kWrite, kSync, kAllocation };
inline constexpr std::size_t kFaultKinds = 4;

struct FaultControl {
  std::atomic<std::uint64_t> recorded{0};                         // operations
  std::array<std::atomic<std::uint64_t>, kFaultKinds> counts{};   // of each kind so far
  std::array<std::atomic<std::uint64_t>, kFaultKinds> failing{};  // its number, from 1; 0: none
  std::atomic<std::uint32_t> lasting{0};                          // 1: and so do all of its kind that follow
  std::atomic<std::int32_t> error{0};                             // 0: it does not fail
  std::atomic<std::uint32_t> hang_ms{0};                          // before it fails or succeeds
  std::atomic<std::uint32_t> hits{0};                             // faults that happened
  std::atomic<std::uint32_t> hanging{0};                          // that hang now
  std::atomic<std::int64_t> clock_step_s{0};                      // by which the time of day has been set forward
};

enum class OperationKind : std::uint32_t {
  kOpen,        // fd, flags, path
  kClose,       // fd
  kDuplicate,   // fd, flags: the new descriptor
  kWrite,       // fd, offset, bytes
  kResize,      // fd, offset: the size
  kResizeAt,    // path, offset: the size
  kExtend,      // fd, offset: the size that the file has at least
  kSync,        // fd
  kFailedSync,  // fd
  kRename,      // path, other, flags as of renameat2; of files and folders, as all that follow
  kLink,        // path, other
  kRemove,      // path: of a file or an empty folder
  kMakeFolder   // path
};

// A record of a trace; `path`, `other` and the bytes follow it. Paths are relative to the root.
struct TraceHeader {
  OperationKind kind = OperationKind::kOpen;
  std::int32_t fd = -1, flags = 0;
  std::uint32_t path = 0, other = 0;  // lengths
  std::uint64_t offset = 0, bytes = 0;
};

}  // namespace relmap::testing
