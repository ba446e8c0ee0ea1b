// What to run a program with so that its file operations are recorded, or fail on demand (interposer.cc).
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/file_faults/control.h"
#include "tests/file_faults/trace.h"

namespace relmap::testing {

enum class Recording { kOn, kOff };

class FileFaults {
 public:
  // `root`: the folder whose files are watched. `notes`: a folder of its own outside `root`, which is made. Throws
  // std::runtime_error.
  FileFaults(const std::string& root, const std::string& notes, Recording recording);
  ~FileFaults();
  FileFaults(const FileFaults&) = delete;
  FileFaults& operator=(const FileFaults&) = delete;

  // For ProcessOptions.
  std::vector<std::string> environment() const;

  // The n-th operation of its kind fails with this error, or hangs first. 0: it only hangs.
  void fail(FaultKind kind, std::uint64_t n, int error, std::chrono::milliseconds hang = {});
  std::uint64_t count(FaultKind kind) const { return control_->counts[static_cast<std::size_t>(kind)]; }
  bool hit() const { return control_->hits > 0; }
  // All operations of the kind from now on, until mend(). Those that hang already still do.
  void fail_from_now_on(FaultKind kind, int error, std::chrono::milliseconds hang = {});
  void mend();
  bool hanging() const { return control_->hanging > 0; }  // now

  // From now on the program's time of day is ahead of the machine's by so much.
  void set_clock(std::int64_t ahead_s) { control_->clock_step_s = ahead_s; }

  // The operations so far: whatever the program has told somebody since then rests on these.
  std::uint64_t recorded() const { return control_->recorded; }
  std::vector<FileOperation> operations() const;

 private:
  const std::string root_, notes_;
  const Recording recording_;
  FaultControl* control_ = nullptr;
};

}  // namespace relmap::testing
