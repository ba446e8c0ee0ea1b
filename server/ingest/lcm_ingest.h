// Ingest over LCM: receives parts, gaps and ends of sessions; sends acknowledgements, status and poses.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "proto/access/access_list.h"
#include "proto/access/datagram_seal.h"
#include "proto/wire/lcm_messages.h"
#include "server/intake/ingest_server.h"

namespace relmap::ingest {

// Whose messages must be sealed (sealed_robots.h). What is not is then not taken, and what robots are told is sealed.
struct LcmAuthentication {
  enum class Who : std::uint8_t {
    kNobody,  // seals are not looked at
    kSome,    // robots named in IntakeOptions::proving; others may seal, too
    kAll,
  };
  Who who = Who::kNobody;
  access::SealKey secret{};  // of the fleet
};

struct LcmOptions {
  std::string url;
  LcmAuthentication authentication = {};
  // Bounds the messages that LCM has received and the intake has not taken yet.
  std::size_t queue_bytes = std::size_t{64} << 20;
};

// Thread-safe.
class LcmIngest {
 public:
  // The content of RELMAP_STATUS, which is sent once a second; boot id, time and uptime are filled in here.
  using StatusSource = std::function<DaemonStatus()>;

  // Starts receiving. `server` must outlive the result. INVALID_ARGUMENT (no LCM URL), NO_MULTICAST_ROUTE (with the
  // commands that add one), IO_ERROR.
  static Result<std::unique_ptr<LcmIngest>> start(const LcmOptions& options, intake::IngestServer& server,
                                                  StatusSource status);
  // Calls stop().
  ~LcmIngest();

  // Whose seals count from now on; until the first call, nobody's.
  void use(const access::AccessList& list);
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
