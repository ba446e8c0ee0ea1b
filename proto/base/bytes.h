// Reads and writes the little-endian bytes of every binary format of relmap (keyframe payload, journal, chunks,
// vocabulary). Integers and IEEE floats take their own width, without padding; the format says how wide counts are.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace relmap {

static_assert(std::endian::native == std::endian::little, "the formats are little-endian; a swap belongs in this file");

using Bytes = std::vector<std::uint8_t>;
using ByteSpan = std::span<const std::uint8_t>;

inline ByteSpan as_bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

template <typename T>
concept Scalar = std::is_arithmetic_v<T> || std::is_enum_v<T>;

class ByteWriter {
 public:
  template <Scalar T>
  void put(T value) {
    put_raw(&value, sizeof value);
  }
  template <Scalar T>
  void put_array(const T* values, std::size_t count) {
    put_raw(values, count * sizeof(T));
  }
  void put_bytes(ByteSpan bytes) { put_raw(bytes.data(), bytes.size()); }
  // Writes the length as u16, then the bytes; `text` must be shorter than 64 KiB.
  void put_string(std::string_view text) {
    put(static_cast<std::uint16_t>(text.size()));
    put_raw(text.data(), text.size());
  }
  // Overwrites what was put at `offset`, such as a length or checksum that is known only at the end.
  template <Scalar T>
  void patch(std::size_t offset, T value) {
    std::memcpy(bytes_.data() + offset, &value, sizeof value);
  }

  std::size_t size() const { return bytes_.size(); }
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  const Bytes& bytes() const { return bytes_; }
  Bytes take() { return std::move(bytes_); }

 private:
  void put_raw(const void* data, std::size_t size) {
    if (size == 0) return;
    const std::size_t old = bytes_.size();
    bytes_.resize(old + size);
    std::memcpy(bytes_.data() + old, data, size);
  }
  Bytes bytes_;
};

// Never reads past the end: such a read returns zeros, and ok() is false from then on. A decoder can therefore read
// without checking each field, and asks ok() before it trusts a count and once at its end.
class ByteReader {
 public:
  explicit ByteReader(ByteSpan bytes) : bytes_(bytes) {}

  template <Scalar T>
  T get() {
    T value{};
    get_raw(&value, sizeof value);
    return value;
  }
  template <Scalar T>
  void get_array(T* values, std::size_t count) {
    get_raw(values, count * sizeof(T));
  }
  ByteSpan get_bytes(std::size_t count) {
    if (!take(count)) return {};
    return bytes_.subspan(position_ - count, count);
  }
  std::string get_string() {
    const auto bytes = get_bytes(get<std::uint16_t>());
    return {bytes.begin(), bytes.end()};
  }
  // True if the bytes that remain can hold `count` items of at least `item_size` bytes. To be asked before memory is
  // reserved for them.
  bool fits(std::size_t count, std::size_t item_size) const {
    return ok_ && (item_size == 0 || count <= remaining() / item_size);
  }

  bool ok() const { return ok_; }
  bool at_end() const { return ok_ && position_ == bytes_.size(); }
  std::size_t remaining() const { return bytes_.size() - position_; }
  std::size_t position() const { return position_; }

 private:
  bool take(std::size_t count) {
    if (!ok_ || count > remaining()) {
      ok_ = false;
      return false;
    }
    position_ += count;
    return true;
  }
  void get_raw(void* data, std::size_t size) {
    if (size == 0) return;
    if (take(size))
      std::memcpy(data, bytes_.data() + position_ - size, size);
    else
      std::memset(data, 0, size);
  }

  ByteSpan bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace relmap
