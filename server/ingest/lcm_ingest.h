// Ingest over LCM: receives parts, gaps and ends of sessions; sends acknowledgements, status and poses.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "proto/wire/lcm_messages.h"
#include "server/intake/ingest_server.h"

namespace relmap::ingest {

// Thread-safe.
class LcmIngest {
 public:
  // The content of RELMAP_STATUS, which is sent once a second; boot id, time and uptime are filled in here.
  using StatusSource = std::function<DaemonStatus()>;

  // Starts receiving. `server` must outlive the result. `queue_bytes` bounds the messages that LCM has received and
  // `server` has not taken yet. INVALID_ARGUMENT (no LCM URL), NO_MULTICAST_ROUTE (with the commands that add one),
  // IO_ERROR.
  static Result<std::unique_ptr<LcmIngest>> start(const std::string& url, intake::IngestServer& server,
                                                  StatusSource status, std::size_t queue_bytes = std::size_t{64} << 20);
  // Calls stop().
  ~LcmIngest();

  // Whether the log that was given as URL has been replayed to its end.
  bool at_end() const;
  // Stops receiving, then stops sending.
  void stop();

 private:
  struct Impl;
  explicit LcmIngest(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::ingest
