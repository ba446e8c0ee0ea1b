#include "proto/base/ids.h"

#include <charconv>
#include <random>

#include "proto/base/hex.h"

namespace relmap {

namespace {

// Removes a decimal number from the front of `text`; false if there is none or it overflows.
bool take_number(std::string_view& text, std::uint32_t& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end == text.data()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

bool take_char(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) return false;
  text.remove_prefix(1);
  return true;
}

bool take_frame(std::string_view& text, FrameId& id) {
  return take_number(text, id.session) && id.session != 0 && take_char(text, ':') && take_number(text, id.index);
}

constexpr bool dash_before(std::size_t byte) { return byte == 4 || byte == 6 || byte == 8 || byte == 10; }

}  // namespace

std::string Uuid::to_string() const {
  std::string text = hex(bytes);
  for (std::size_t byte = bytes.size(); byte-- > 0;)
    if (dash_before(byte)) text.insert(2 * byte, 1, '-');
  return text;
}

std::optional<Uuid> Uuid::parse(std::string_view text) {
  Uuid uuid;
  for (std::size_t i = 0; i < uuid.bytes.size(); ++i) {
    if (dash_before(i) && !take_char(text, '-')) return std::nullopt;
    if (text.size() < 2) return std::nullopt;
    const int high = hex_digit(text[0]), low = hex_digit(text[1]);
    if (high < 0 || low < 0) return std::nullopt;
    uuid.bytes[i] = static_cast<std::uint8_t>(high * 16 + low);
    text.remove_prefix(2);
  }
  if (!text.empty()) return std::nullopt;
  return uuid;
}

Uuid Uuid::random() {
  std::random_device entropy;
  Uuid uuid;
  for (std::size_t i = 0; i < uuid.bytes.size(); i += 4) {
    const std::uint32_t word = entropy();
    __builtin_memcpy(&uuid.bytes[i], &word, 4);
  }
  uuid.bytes[6] = static_cast<std::uint8_t>((uuid.bytes[6] & 0x0f) | 0x40);  // version 4,
  uuid.bytes[8] = static_cast<std::uint8_t>((uuid.bytes[8] & 0x3f) | 0x80);  // RFC 4122 variant
  return uuid;
}

std::string FrameId::to_string() const { return std::to_string(session) + ':' + std::to_string(index); }

std::optional<FrameId> FrameId::parse(std::string_view text) {
  FrameId id;
  if (!take_frame(text, id) || !text.empty()) return std::nullopt;
  return id;
}

std::string EdgeId::to_string() const { return frame.to_string() + '/' + std::to_string(ordinal); }

std::optional<EdgeId> EdgeId::parse(std::string_view text) {
  EdgeId id;
  if (!take_frame(text, id.frame) || !take_char(text, '/') || !take_number(text, id.ordinal) || !text.empty())
    return std::nullopt;
  return id;
}

std::string LandmarkId::to_string() const { return base.to_string() + '.' + std::to_string(slot); }

}  // namespace relmap
