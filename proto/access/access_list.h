// The file by which a daemon knows tokens, keys, and certificates that were revoked. One line for each credential that
// was issued:
//
//   # KIND HASH ROLE EXPIRES STATE NAME
//   token 2c26b4...7ae robot 2027-11-29T00:00:00Z valid cart-1
//   certificate 9f86d0...a08 operator 2027-11-29T00:00:00Z revoked anna
//   key 60303a...2e7 robot 2027-11-29T00:00:00Z valid cart-1
//
// HASH is the SHA-256 of a token, or of a certificate's DER. Of a key it is 32 random bytes, which lead to the key only
// together with the fleet's secret (datagram_seal.h). A token or key that has no valid line is refused. A certificate
// is refused if its line says so; one without a line is judged by its issuer alone, so that certificates of another
// authority need none here.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/access/principal.h"
#include "proto/base/status.h"

namespace relmap::access {

struct Grant {
  enum class Kind : std::uint8_t { kToken, kCertificate, kKey };

  Kind kind = Kind::kToken;
  std::string hash;  // 64 hexadecimal digits
  Principal principal;
  std::int64_t expires_s = 0;  // UTC, since 1970
  bool revoked = false;

  bool operator==(const Grant&) const = default;
};
std::string_view kind_name(Grant::Kind kind);  // "token", "certificate", "key"

class AccessList {
 public:
  // Reads the lines of a file, of which the first is the comment above; '#' begins others. BAD_CONFIG with "NAME:LINE:
  // ..." if that line is missing, and for a line that is malformed or whose hash is there twice.
  static Result<AccessList> parse(std::string_view text, const std::string& name);
  std::string text() const;

  const std::vector<Grant>& grants() const { return grants_; }
  const Grant* find(Grant::Kind kind, std::string_view hash) const;
  void add(Grant grant) { grants_.push_back(std::move(grant)); }
  // Revokes all of this name. Returns how many were valid until now.
  std::size_t revoke(std::string_view name);

 private:
  std::vector<Grant> grants_;
};

// BAD_CONFIG, NO_SUCH_FILE, IO_ERROR.
Result<AccessList> read_access_list(const std::string& path);

// "2027-11-29T00:00:00Z" (RFC 3339, in UTC) from and to seconds since 1970.
std::string time_text(std::int64_t seconds);
std::optional<std::int64_t> time_of(std::string_view text);

}  // namespace relmap::access
