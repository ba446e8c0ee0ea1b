#include "storage/format/sealed.h"

#include "proto/base/crc32c.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kSealedHeaderBytes = 8;  // u16 version, u8 kind, u8 zero, u32 length of the body

}  // namespace

Bytes seal(std::uint8_t kind, std::uint16_t version, ByteSpan body) {
  ByteWriter w;
  w.reserve(kSealedHeaderBytes + body.size() + sizeof(std::uint32_t));
  w.put(version);
  w.put(kind);
  w.put(std::uint8_t{0});
  w.put(static_cast<std::uint32_t>(body.size()));
  w.put_bytes(body);
  w.put(crc32c(w.bytes()));
  return w.take();
}

Result<Sealed> unseal(ByteSpan bytes, std::uint16_t oldest, std::uint16_t newest) {
  ByteReader r(bytes);
  Sealed sealed;
  sealed.version = r.get<std::uint16_t>();
  sealed.kind = r.get<std::uint8_t>();
  const auto zero = r.get<std::uint8_t>();
  sealed.body = r.get_bytes(r.get<std::uint32_t>());
  const auto crc = r.get<std::uint32_t>();
  if (!r.ok()) return Status(Reason::TRUNCATED, "a record of " + std::to_string(bytes.size()) + " bytes");
  if (!r.at_end() || zero != 0 || crc != crc32c(bytes.first(bytes.size() - sizeof crc)))
    return Status(Reason::CORRUPT, "a record of " + std::to_string(bytes.size()) + " bytes");
  if (sealed.version < oldest || sealed.version > newest)
    return Status(Reason::UNKNOWN_FORMAT_VERSION, "record of version " + std::to_string(sealed.version));
  return sealed;
}

}  // namespace relmap::storage
