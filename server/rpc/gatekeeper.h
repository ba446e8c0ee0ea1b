// Tells who a caller is from what the connection and the call show, without gRPC.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "proto/access/access_list.h"
#include "proto/access/certificate.h"
#include "proto/access/principal.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::rpc {

using access::Role;

// What a call shows of its caller.
struct Evidence {
  enum class Way : std::uint8_t {
    kSocket,  // the daemon's Unix socket: whoever can open it is an operator
    kTls,     // a certificate or a token is needed
    kOpen,    // TCP without TLS: everyone is an operator if the configuration says so, and nobody otherwise
  };
  Way way = Way::kOpen;
  std::string_view certificate;  // PEM, verified by TLS against the authority; empty: none was shown
  std::string_view token;        // of "authorization: Bearer TOKEN"; empty: none. It decides if both are there
};

struct Identity {
  std::string name;
  Role role = Role::kReader;
  std::int64_t expires_s = INT64_MAX;  // UTC, since 1970
  std::uint64_t version = 0;           // of the access list by which it was judged

  // The robot whose sessions it may send to; empty: those of any.
  std::string robot() const { return role == Role::kRobot ? name : std::string(); }
};

// Thread-safe.
class Gatekeeper {
 public:
  // `list`: the file of tokens and revocations; empty: there are none. `open`: everyone is an operator who comes over
  // TCP without TLS.
  explicit Gatekeeper(std::string list = {}, bool open = false) : file_(std::move(list)), open_(open) {}

  // Reads the file again. If it cannot be read, the former list stays in force: BAD_CONFIG, NO_SUCH_FILE.
  Status reload();
  // The same if the file has changed since it was last read with success.
  Status reload_if_changed();
  // Raised by each reload, after which identities may have been revoked.
  std::uint64_t version() const { return version_; }

  // Why the last attempt to read the list failed; ok if it did not.
  Status problem() const {
    const MutexLock lock(mutex_);
    return problem_;
  }

  // The list in force.
  std::shared_ptr<const access::AccessList> list() const {
    const MutexLock lock(mutex_);
    return list_;
  }

  // UNAUTHENTICATED with what is missing, unknown, expired or revoked.
  Result<Identity> identify(const Evidence& evidence) const;
  // Whether the identity still holds: judged by the present list, and not expired.
  bool is_current(const Identity& identity) const;

 private:
  struct Stamp {
    std::int64_t modified_ns = 0, size = 0;
    std::uint64_t inode = 0;
    bool operator==(const Stamp&) const = default;
  };
  Stamp stamp() const;
  Result<access::CertificateFacts> facts_of(std::string_view pem) const;

  const std::string file_;
  const bool open_;
  mutable Mutex mutex_;
  std::shared_ptr<const access::AccessList> list_ RELMAP_GUARDED_BY(mutex_) =
      std::make_shared<const access::AccessList>();
  Stamp read_ RELMAP_GUARDED_BY(mutex_);
  Status problem_ RELMAP_GUARDED_BY(mutex_);
  std::atomic<std::uint64_t> version_ = 0;
  // Certificates that were shown lately, so that each is parsed once and not with each call.
  mutable std::map<std::string, access::CertificateFacts, std::less<>> seen_ RELMAP_GUARDED_BY(mutex_);
};

}  // namespace relmap::rpc
