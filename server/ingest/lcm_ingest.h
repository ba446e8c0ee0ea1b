// Ingest over LCM: parts and gaps in; acknowledgements, status and poses out.
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
  // What RELMAP_STATUS says, once a second; boot id, time and uptime are filled in here.
  using StatusSource = std::function<DaemonStatus()>;

  // `server` outlives it. `queue_bytes`: of messages that LCM has received and nobody has looked at. INVALID_ARGUMENT
  // (no LCM URL), NO_MULTICAST_ROUTE (with the commands that mend it), IO_ERROR.
  static Result<std::unique_ptr<LcmIngest>> start(const std::string& url, intake::IngestServer& server,
                                                  StatusSource status, std::size_t queue_bytes = std::size_t{64} << 20);
  // As stop().
  ~LcmIngest();

  // A log that was given as URL has been replayed.
  bool at_end() const;
  // Takes nothing more from LCM, then says nothing more.
  void stop();

 private:
  struct Impl;
  explicit LcmIngest(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::ingest
