// Seals on datagrams, which have neither connections nor senders: a seal proves of which robot a message is, or for
// which robot, and that it is one of these seconds and comes once. What is sealed can be read by everyone.
//
// The 48 bytes of a seal follow the message: key id, run, time, count (8 bytes each, little-endian), and a tag of 16
// bytes. The tag is HMAC-SHA256 (RFC 2104), cut to its first half, of
//   "relmap seal 1", who sealed (1 byte), length of the channel's name (1 byte), the name,
//   the boot id of the daemon that is meant (16 bytes; zeros where it is not known or the daemon itself seals),
//   the message, key id, run, time and count.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::access {

inline constexpr std::size_t kSealBytes = 48;

using SealKey = std::array<std::uint8_t, 32>;
using SealKeyId = std::array<std::uint8_t, 8>;  // names a key in every message
using SealBoot = std::array<std::uint8_t, 16>;

// A robot's key, as its credentials have it.
struct RobotKey {
  SealKeyId id{};
  SealKey key{};
  bool operator==(const RobotKey&) const = default;
};

enum class SealedBy : std::uint8_t { kRobot = 1, kDaemon = 2 };

struct Seal {
  SealKeyId key{};
  std::uint64_t run = 0;      // random, of the robot's process that sends, or that the message is for
  std::uint64_t time_us = 0;  // of the daemon, since its start: now, or as the robot last heard it
  std::uint64_t count = 0;    // of the sender's messages; each has another
};

struct SealedMessage {
  ByteSpan message;
  Seal seal;
  ByteSpan tag;
};
// Takes a datagram apart, without judging the tag; nullopt if it is too short to have a seal. The spans point into it.
std::optional<SealedMessage> split_sealed(ByteSpan datagram);

// Seals and verifies with one key. Not thread-safe. Throws std::runtime_error if OpenSSL has no HMAC-SHA256.
class Sealer {
 public:
  explicit Sealer(const SealKey& key);
  Sealer(Sealer&&) noexcept;
  Sealer& operator=(Sealer&&) noexcept;
  ~Sealer();

  // Appends the seal to the message. `channel` has at most 255 bytes.
  void seal(SealedBy by, std::string_view channel, const SealBoot& daemon, const Seal& seal, Bytes& message);
  // Whether the tag is that of this key; it takes the same time whatever the tag.
  bool verify(SealedBy by, std::string_view channel, const SealBoot& daemon, const SealedMessage& sealed);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The key of a robot follows from the secret of its fleet and from 32 bytes that were drawn for the robot, which are no
// secret: it is their HMAC-SHA256, and their first 8 bytes are its id.
RobotKey robot_key(const SealKey& secret, const SealKey& drawn);

// The bytes of 64 hexadecimal digits; nullopt for any other text.
std::optional<SealKey> key_of_hex(std::string_view digits);

// The secret of a fleet in a file, which must be readable by its owner only. NO_SUCH_FILE, BAD_CONFIG.
Result<SealKey> read_secret(const std::string& path);

// 32 random bytes. Throws std::runtime_error if the system has no randomness.
SealKey random_key();

}  // namespace relmap::access
