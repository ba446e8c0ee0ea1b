// Certificates (X.509) by which daemons and their callers prove who they are over TLS. Texts are PEM.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/access/principal.h"
#include "proto/base/status.h"

namespace relmap::access {

struct KeyPair {
  std::string certificate, key;
};

// What an issued certificate is for. Its key is new, on the curve P-256.
struct CertificateWish {
  std::string common_name;             // for display
  std::vector<std::string> hosts;      // names and addresses of a daemon: it may serve TLS there
  std::optional<Principal> principal;  // of a caller: it may call as this one
  int days = 365;                      // until it expires
};

// A new authority, whose certificate signs itself. Throws std::runtime_error if OpenSSL fails.
KeyPair new_authority(const std::string& common_name, int days);
// A certificate of this authority. CORRUPT if the authority cannot be read.
Result<KeyPair> issue(const KeyPair& authority, const CertificateWish& wish);

struct CertificateFacts {
  std::optional<Principal> principal;  // none: no name of the form "relmap:ROLE:NAME"
  std::vector<std::string> hosts;      // names and addresses at which it may serve TLS
  std::string hash;                    // SHA-256 of its DER
  std::int64_t expires_s = 0;          // UTC, since 1970
};
// Of the first certificate in `pem`. CORRUPT if there is none.
Result<CertificateFacts> read_certificate(std::string_view pem);

// CORRUPT if one of them cannot be read or the key is not the certificate's.
Status check_key_pair(const KeyPair& pair);

}  // namespace relmap::access
