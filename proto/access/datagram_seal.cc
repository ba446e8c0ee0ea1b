#include "proto/access/datagram_seal.h"

#include <openssl/core_names.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <algorithm>
#include <cassert>
#include <stdexcept>

#include "proto/access/file.h"
#include "proto/access/openssl.h"
#include "proto/base/hex.h"

namespace relmap::access {

namespace {

constexpr std::size_t kTagBytes = 16;
constexpr std::size_t kFieldBytes = kSealBytes - kTagBytes;
constexpr std::string_view kLabel = "relmap seal 1";

using Digest = std::array<std::uint8_t, 32>;

// Fetched once, since OpenSSL looks for it under a lock.
EVP_MAC* hmac_algorithm() {
  static const std::unique_ptr<EVP_MAC, Freed<EVP_MAC_free>> mac(EVP_MAC_fetch(nullptr, "HMAC", nullptr));
  return mac.get();
}

Bytes fields_of(const Seal& seal) {
  ByteWriter out;
  out.put_bytes(seal.key);
  out.put(seal.run);
  out.put(seal.time_us);
  out.put(seal.count);
  return out.take();
}

}  // namespace

// HMAC-SHA256 with one key.
class Hmac {
 public:
  explicit Hmac(const SealKey& key) : context_(EVP_MAC_CTX_new(hmac_algorithm())) {
    char digest[] = "SHA256";
    const OSSL_PARAM parameters[] = {OSSL_PARAM_construct_utf8_string(OSSL_MAC_PARAM_DIGEST, digest, 0),
                                     OSSL_PARAM_construct_end()};
    if (!context_ || EVP_MAC_init(context_.get(), key.data(), key.size(), parameters) != 1)
      throw std::runtime_error("OpenSSL has no HMAC-SHA256");
  }

  // Starts again with the same key.
  void begin() {
    if (EVP_MAC_init(context_.get(), nullptr, 0, nullptr) != 1) throw std::runtime_error("HMAC-SHA256 failed");
  }
  void add(ByteSpan bytes) {
    if (EVP_MAC_update(context_.get(), bytes.data(), bytes.size()) != 1) throw std::runtime_error("HMAC-SHA256 failed");
  }
  Digest end() {
    Digest digest{};
    std::size_t size = 0;
    if (EVP_MAC_final(context_.get(), digest.data(), &size, digest.size()) != 1 || size != digest.size())
      throw std::runtime_error("HMAC-SHA256 failed");
    return digest;
  }

 private:
  std::unique_ptr<EVP_MAC_CTX, Freed<EVP_MAC_CTX_free>> context_;
};

struct Sealer::Impl {
  explicit Impl(const SealKey& key) : hmac(key) {}

  Digest tag(SealedBy by, std::string_view channel, const SealBoot& daemon, ByteSpan message, ByteSpan fields) {
    assert(channel.size() <= 255);
    const std::array<std::uint8_t, 2> head{static_cast<std::uint8_t>(by), static_cast<std::uint8_t>(channel.size())};
    hmac.begin();
    for (const ByteSpan part : {as_bytes(kLabel), ByteSpan(head), as_bytes(channel), ByteSpan(daemon), message, fields})
      hmac.add(part);
    return hmac.end();
  }

  Hmac hmac;
};

Sealer::Sealer(const SealKey& key) : impl_(std::make_unique<Impl>(key)) {}
Sealer::Sealer(Sealer&&) noexcept = default;
Sealer& Sealer::operator=(Sealer&&) noexcept = default;
Sealer::~Sealer() = default;

void Sealer::seal(SealedBy by, std::string_view channel, const SealBoot& daemon, const Seal& seal, Bytes& message) {
  const Bytes fields = fields_of(seal);
  const Digest tag = impl_->tag(by, channel, daemon, message, fields);
  message.insert(message.end(), fields.begin(), fields.end());
  message.insert(message.end(), tag.begin(), tag.begin() + kTagBytes);
}

bool Sealer::verify(SealedBy by, std::string_view channel, const SealBoot& daemon, const SealedMessage& sealed) {
  const Digest tag = impl_->tag(by, channel, daemon, sealed.message, fields_of(sealed.seal));
  return sealed.tag.size() == kTagBytes && CRYPTO_memcmp(tag.data(), sealed.tag.data(), kTagBytes) == 0;
}

std::optional<SealedMessage> split_sealed(ByteSpan datagram) {
  if (datagram.size() < kSealBytes) return std::nullopt;
  SealedMessage sealed;
  sealed.message = datagram.first(datagram.size() - kSealBytes);
  ByteReader in(datagram.last(kSealBytes));
  in.get_array(sealed.seal.key.data(), sealed.seal.key.size());
  sealed.seal.run = in.get<std::uint64_t>();
  sealed.seal.time_us = in.get<std::uint64_t>();
  sealed.seal.count = in.get<std::uint64_t>();
  sealed.tag = in.get_bytes(kTagBytes);
  return sealed;
}

RobotKey robot_key(const SealKey& secret, const SealKey& drawn) {
  Hmac mac(secret);
  mac.begin();
  mac.add(as_bytes("relmap robot key 1"));
  mac.add(drawn);
  RobotKey key;
  key.key = mac.end();
  std::copy_n(drawn.begin(), key.id.size(), key.id.begin());
  return key;
}

std::optional<SealKey> key_of_hex(std::string_view digits) {
  SealKey key{};
  if (digits.size() != 2 * key.size()) return std::nullopt;
  for (std::size_t i = 0; i < key.size(); ++i) {
    const int high = hex_digit(digits[2 * i]), low = hex_digit(digits[2 * i + 1]);
    if (high < 0 || low < 0) return std::nullopt;
    key[i] = static_cast<std::uint8_t>(16 * high + low);
  }
  return key;
}

Result<SealKey> read_secret(const std::string& path) {
  const auto text = read_private_file(path);
  if (!text.ok()) return text.status();
  const auto key = key_of_hex(std::string_view(*text).substr(0, text->find('\n')));
  if (!key) return Status(Reason::BAD_CONFIG, path + " has not 64 hexadecimal digits");
  return *key;
}

SealKey random_key() {
  SealKey key{};
  if (RAND_bytes(key.data(), static_cast<int>(key.size())) != 1) throw std::runtime_error("no randomness");
  return key;
}

}  // namespace relmap::access
