// The file that its owner shows to daemons: who issued the daemon's certificate, and a certificate with its key or a
// token. One text of PEM blocks, which must be readable by its owner only:
//
//   -----BEGIN PRIVATE KEY-----       with its certificate: a caller known by certificate
//   -----BEGIN CERTIFICATE-----       the certificate of the key, and those of the authorities that are believed
//   -----BEGIN RELMAP TOKEN-----      a caller known by token; no private key then
//   -----BEGIN RELMAP KEY-----        a robot's, for LCM: its id (8 bytes) and the key (32)
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "proto/access/datagram_seal.h"
#include "proto/base/status.h"

namespace relmap::access {

struct Credentials {
  std::string authorities;       // certificates of those that may have issued a daemon's
  std::string certificate, key;  // empty: known by token
  std::string token;             // empty: known by certificate
  std::optional<RobotKey> robot_key = {};
};

std::string text_of(const Credentials& credentials);
// CORRUPT if there is no certificate of an authority, or neither a private key with its certificate nor a token, or
// both, or if a robot's key has another length.
Result<Credentials> parse_credentials(std::string_view text);
// NO_SUCH_FILE. BAD_CONFIG, with the path: it is malformed, or others than its owner can read it.
Result<Credentials> read_credentials(const std::string& path);

// The certificates of authorities in a file for a program that asks a daemon for others, each with a token of his own:
// ca.crt, or credentials with a token, which is not looked at. NO_SUCH_FILE. BAD_CONFIG: there is none, or the file has
// a private key, with which all others would be taken for its owner.
Result<std::string> read_authorities(const std::string& path);

}  // namespace relmap::access
