// relmapd as a process of its own, on a free port, with clients for it.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/relmap_client.h"
#include "tests/support/process.h"

namespace relmap::testing {

// A multicast group and port that no other test uses, within this machine.
std::string random_lcm_url();

struct DaemonOptions {
  std::string data;  // folder
  std::string lcm;   // empty: off
  std::size_t memory_budget_mb = 256;
  std::vector<std::string> more;              // arguments
  std::string program = {};                   // relmapd of another build; empty: of this one
  std::optional<Multicast> own_network = {};  // see ProcessOptions
  std::string credentials = {};               // folder, to serve TLS and authenticate LCM with; empty: neither
  std::vector<std::string> environment = {};  // see ProcessOptions
};

// Throws with the daemon's log if it does not serve within `patience`; 0: does not wait.
class RunningDaemon {
 public:
  explicit RunningDaemon(const DaemonOptions& options, std::chrono::milliseconds patience = kPatience);

  Process& process() { return *process_; }
  // Whether DIR/endpoint names this process.
  bool serving() const;
  std::string address() const;  // over TCP
  std::string http() const;     // HOST:PORT; empty without --http
  std::unique_ptr<client::Client> client() const;
  std::string log() const;

  // Sends SIGTERM; returns the exit code, or -1 if the daemon does not stop.
  int stop();

 private:
  std::string endpoint(const std::string& key) const;
  const DaemonOptions options_;
  std::unique_ptr<Process> process_;
};

// The arguments of relmapd for these options.
std::vector<std::string> daemon_arguments(const DaemonOptions& options);

}  // namespace relmap::testing
