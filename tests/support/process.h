// Programs of the build, run as a user would: started with arguments, waited for, ended. What cannot be started throws.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/private_network.h"

namespace relmap::testing {

// A program in the folder of those built beside this test.
std::string built_program(const std::string& name);

struct ProcessOptions {
  std::string standard_output, standard_error;  // files, appended to; empty: /dev/null
  // A network namespace of its own with nothing but loopback, with or without a route for multicast.
  std::optional<Multicast> own_network = {};
  // A terminal's descriptor: standard input and standard error are it. -1: standard input is the test's own.
  int terminal = -1;
};

// Ends with the test, however that ends.
class Process {
 public:
  Process(const std::vector<std::string>& arguments, const ProcessOptions& options);
  ~Process();  // kill -9
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  bool running();
  void signal(int number);
  // kill -9, and gone on return.
  void kill();
  // The exit code, 128 + n after signal n; nullopt if it is still running after `patience`.
  std::optional<int> wait(std::chrono::milliseconds patience);
  // VmHWM: the most memory that was ever resident, bytes.
  std::size_t peak_resident_bytes() const;

 private:
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

struct Finished {
  int exit_code = -1;
  std::string standard_output, standard_error;
};
// Runs it to its end; throws if it takes longer than `patience`.
Finished run_program(const std::vector<std::string>& arguments,
                     std::chrono::milliseconds patience = std::chrono::seconds(50));

std::string read_text(const std::string& path);

}  // namespace relmap::testing
