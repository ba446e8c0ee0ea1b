#include "server/rpc/watch_token.h"

#include <array>
#include <cstdint>

#include "proto/base/bytes.h"
#include "proto/base/crc32c.h"
#include "proto/base/hex.h"
#include "proto/base/read_number.h"

namespace relmap::rpc {

namespace {

constexpr std::string_view kVersion = "1", kOwner = "0";
constexpr std::size_t kMaxTokenBytes = 256;
constexpr std::size_t kParts = 7;

std::string check_of(std::string_view text) {
  return hex(crc32c(ByteSpan(reinterpret_cast<const std::uint8_t*>(text.data()), text.size())));
}

}  // namespace

std::string watch_token_text(const WatchToken& token) {
  std::string text(kVersion);
  text += "." + token.map.uuid.to_string() + "." + std::to_string(token.map.epoch) + "." + std::string(kOwner) + "." +
          std::to_string(token.at.sequence) + "." + std::to_string(token.at.ordinal);
  return text + "." + check_of(text);
}

Result<WatchToken> read_watch_token(std::string_view text) {
  const Status not_one(Reason::INVALID_ARGUMENT,
                       "'" + std::string(text.substr(0, 64)) + "' is not a resume token of WatchMap, or was mangled");
  if (text.size() > kMaxTokenBytes) return not_one;
  std::array<std::string_view, kParts> parts;
  std::string_view left = text;
  for (std::size_t i = 0; i < kParts; ++i) {
    const std::size_t point = left.find('.');
    if ((point == std::string_view::npos) != (i + 1 == kParts)) return not_one;
    parts[i] = left.substr(0, point);
    if (i + 1 < kParts) left.remove_prefix(point + 1);
  }
  const auto& [version, uuid, epoch, owner, sequence, ordinal, check] = parts;
  if (check != check_of(text.substr(0, text.size() - check.size() - 1))) return not_one;
  if (version != kVersion || owner != kOwner)
    return {Reason::INVALID_ARGUMENT, "the resume token is of a later version of relmapd"};
  WatchToken token;
  const auto known = Uuid::parse(uuid);
  if (!known || !read_number(epoch, token.map.epoch) || !read_number(sequence, token.at.sequence) ||
      !read_number(ordinal, token.at.ordinal))
    return not_one;
  token.map.uuid = *known;
  return token;
}

}  // namespace relmap::rpc
