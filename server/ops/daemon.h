// The daemon as a whole: data folder, map, ways in and out; what relmapd is but for its command line.
#pragma once

#include <memory>
#include <string>

#include "server/ops/config.h"

namespace relmap::ops {

class Daemon {
 public:
  // Takes the data folder (made if there is none), recovers the map, serves gRPC, writes DIR/endpoint, and starts LCM
  // ingest if the configuration names a URL; if that fails, says so in the log and in status and serves all the same.
  // BAD_CONFIG, FOLDER_LOCKED, PORT_IN_USE, NO_SUCH_FILE (the vocabulary), WRONG_VOCABULARY, and what is wrong with the
  // folder: NOT_A_MAP (nothing is written to it then), IO_ERROR, DATA_LOSS, UNKNOWN_FORMAT_VERSION.
  static Result<std::unique_ptr<Daemon>> start(const Config& config);
  // What start() would say of the configuration by itself, of the files that it names, and of a data folder that is
  // none. Writes nothing, takes no lock and no port.
  static Status check(const Config& config);
  // As stop().
  ~Daemon();

  // host:port that gRPC is served on.
  const std::string& address() const;

  // What has to be done now and then: about once a second.
  void tick();

  // Takes nothing more in, ends running calls, applies what is durable, commits. Not ok: the last commit failed (what
  // was acknowledged is in the journal all the same).
  Status stop();

 private:
  struct Impl;
  explicit Daemon(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::ops
