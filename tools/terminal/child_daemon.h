// A relmapd that a command starts for itself.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/status.h"

namespace relmap::terminal {

// The relmapd beside this program as a child process, which ends with this one, however that ends.
class ChildDaemon {
 public:
  struct End {
    int status = 0;  // of waitpid()
    bool ok() const { return status == 0; }
    std::string words() const;  // "exit code 1", "signal 9"
  };

  // Must be called by a thread that lives as long as the process. `log`: a file that relmapd's log is appended to;
  // empty: standard error. `if_left`: the signal that it gets if this process ends without having stopped it.
  // NO_SUCH_FILE: there is no relmapd; the message is its path. INTERNAL: it cannot be started.
  static Result<ChildDaemon> start(const std::vector<std::string>& arguments, const std::string& log, int if_left);
  ~ChildDaemon();  // as if this process ended, and waits for it
  ChildDaemon(ChildDaemon&& other) noexcept : pid_(std::exchange(other.pid_, -1)), if_left_(other.if_left_) {}
  ChildDaemon& operator=(ChildDaemon&&) = delete;

  // -1: it has ended.
  pid_t pid() const { return pid_; }
  // How it has ended, once; nullopt while it runs.
  std::optional<End> ended();
  // Asks it to end in order. It has to be running.
  void ask_to_end() const;

 private:
  ChildDaemon(pid_t pid, int if_left) : pid_(pid), if_left_(if_left) {}
  pid_t pid_;
  int if_left_;
};

}  // namespace relmap::terminal
