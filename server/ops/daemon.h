// The whole daemon except its command line: data folder, map, ingest and RPC server.
#pragma once

#include <memory>
#include <string>

#include "server/ops/config.h"
#include "server/rpc/core.h"

namespace relmap::ops {

class Daemon {
 public:
  // Locks the data folder (creating it if necessary), recovers the map, serves gRPC, starts LCM ingest if the
  // configuration has a URL, and writes DIR/endpoint. If LCM cannot start, the log and the status name the reason and
  // the daemon serves without it. BAD_CONFIG, FOLDER_LOCKED, PORT_IN_USE, NO_SUCH_FILE (the vocabulary),
  // WRONG_VOCABULARY, and for the folder NOT_A_MAP (nothing is written to it then), IO_ERROR, DATA_LOSS,
  // UNKNOWN_FORMAT_VERSION. SHUTTING_DOWN if the process is told to stop (signals.h) during work that can wait.
  static Result<std::unique_ptr<Daemon>> start(const Config& config);
  // Checks the configuration, the files that it names, and whether the data folder is a map or may become one, with the
  // errors of start(). Writes nothing and takes no lock and no port.
  static Status check(const Config& config);
  // Calls stop().
  ~Daemon();

  // Where gRPC is served: the path of the Unix socket, and HOST:PORT, which is empty without TCP.
  const std::string& socket() const;
  const std::string& address() const;
  // HOST:PORT of HTTP; empty without it.
  const std::string& http() const;

  // Periodic work. Call about once a second. Reads the access list again if it has changed.
  void tick();
  // Reads the files of tokens and revocations again, says in the log whether those of TLS, which are read again when
  // they change, can be used, and puts what can change of `fresh` in force (Setting::live). False if something stays as
  // it was, of which the log says why.
  bool reload(const Config& fresh);

  // What is wrong with the daemon, if anything is. Waits for nothing that may hang. Thread-safe.
  rpc::HealthFacts health() const;
  // The same on one line, with what the daemon does.
  std::string status_line() const;

  // Tells that it stops, takes nothing more in, ends running calls, applies what is durable, and commits. Not OK if the
  // last commit failed; acknowledged keyframes are in the journal even then.
  Status stop();

 private:
  struct Impl;
  explicit Daemon(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::ops
