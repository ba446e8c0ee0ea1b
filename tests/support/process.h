// Runs programs of the build as a user would. Throws if a program cannot be started.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/patience.h"
#include "tests/support/private_network.h"

namespace relmap::testing {

// The path of a program of this build.
std::string built_program(const std::string& name);

struct ProcessOptions {
  std::string standard_output, standard_error;  // files, appended to; empty: /dev/null
  // Runs in a network namespace of its own that has only loopback, with or without a route for multicast.
  std::optional<Multicast> own_network = {};
  // Descriptor of a terminal that becomes standard input and standard error; -1: standard input is that of the test.
  int terminal = -1;
  std::vector<std::string> environment = {};  // NAME=value, beside that of the test
};

// The process is killed when the test ends, even if the test crashes.
class Process {
 public:
  Process(const std::vector<std::string>& arguments, const ProcessOptions& options);
  ~Process();  // kill -9
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  bool running();
  void signal(int number);
  // kill -9; the process has ended on return.
  void kill();
  // The exit code, 128 + n after signal n; nullopt if it is still running after `patience`.
  std::optional<int> wait(std::chrono::milliseconds patience);
  // VmHWM: the peak of resident memory, bytes.
  std::size_t peak_resident_bytes() const;
  // User and system time since the process began, seconds.
  double cpu_seconds() const;

 private:
  pid_t pid_ = -1;
  std::optional<int> exit_code_;
};

struct Finished {
  int exit_code = -1;
  std::string standard_output, standard_error;
};
// Runs a program to its end; throws if it takes longer than `patience`.
Finished run_program(const std::vector<std::string>& arguments, std::chrono::milliseconds patience = kPatience,
                     const std::vector<std::string>& environment = {});

std::string read_text(const std::string& path);

}  // namespace relmap::testing
