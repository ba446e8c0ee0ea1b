// Power failures after the operations of a trace, one after the other.
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/file_faults/disk_model.h"

namespace relmap::testing {

struct Thoroughness {
  std::size_t moments = 0;  // after so many of the operations, evenly spread; 0: after all
  int seeds = 1;            // parts of what is not durable that survive, for each moment
};

// A disk as a power failure left it.
struct LeftDisk {
  std::string root;
  std::uint64_t operations = 0;  // of the trace, done before the failure
  bool finished = false;         // these were all
  std::uint64_t number = 0;      // of this state, from 0
};

struct SweepResult {
  std::size_t operations = 0;  // that change what a failure leaves
  std::size_t states = 0;      // that were checked
  std::vector<std::string> wrong;
  std::string summary() const;
};

// A state that must not be.
struct BrokenPromise : std::runtime_error {
  using std::runtime_error::runtime_error;
};
void promise(bool kept, const std::string& what);

// Does the operations on the disk, and after each chosen one lays out what is durable then, and other states by chance,
// in a folder that is removed afterwards. `check` throws BrokenPromise, or anything else. Ends after `most` of them.
SweepResult fail_power_during(DiskModel disk, const std::vector<FileOperation>& operations, const Thoroughness& how,
                              const std::function<void(const LeftDisk&)>& check, std::size_t most = 5);

}  // namespace relmap::testing
