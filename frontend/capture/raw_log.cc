#include "frontend/capture/raw_log.h"

#include <cmath>
#include <fstream>

#include "proto/base/crc32c.h"
#include "proto/calibration/calibration_bytes.h"

namespace relmap::capture {

namespace {

constexpr std::string_view kLogMagic = "RELMAPRW";
constexpr std::uint32_t kLogVersion = 1;
constexpr std::string_view kSync = "\xf5RLG";
constexpr std::uint8_t kHasCycle = 1;  // flag of a head
constexpr std::size_t kMaxName = 255;
constexpr int kMaxFrameSide = 16384;  // pixels

std::string_view text_of(ByteSpan bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

}  // namespace

bool is_raw_log(const std::string& path) {
  char begin[kLogMagic.size()] = {};
  std::ifstream in(path, std::ios::binary);
  return in.read(begin, sizeof begin) && std::string_view(begin, sizeof begin) == kLogMagic;
}

namespace raw_log {

Bytes encode_begin() {
  ByteWriter out;
  out.put_bytes(as_bytes(kLogMagic));
  out.put(kLogVersion);
  return out.take();
}

Status check_begin(ByteSpan begin) {
  ByteReader in(begin);
  if (text_of(in.get_bytes(kLogMagic.size())) != kLogMagic) return {Reason::CORRUPT, "is no raw log"};
  const auto version = in.get<std::uint32_t>();
  if (version != kLogVersion) return {Reason::UNKNOWN_FORMAT_VERSION, "is of version " + std::to_string(version)};
  return {};
}

Bytes encode_head(const Head& head) {
  ByteWriter out;
  out.reserve(kHeadBytes);
  out.put_bytes(as_bytes(kSync));
  out.put(head.kind);
  out.put(head.cycle ? kHasCycle : std::uint8_t{0});
  out.put(head.reason);
  out.put(head.bytes);
  out.put(head.crc);
  out.put(head.time_us);
  out.put(head.number);
  out.put(head.cycle.value_or(0));
  out.put(crc32c(out.bytes()));
  return out.take();
}

std::optional<Head> decode_head(ByteSpan bytes) {
  ByteReader in(bytes);
  if (bytes.size() < kHeadBytes || text_of(in.get_bytes(kSync.size())) != kSync) return std::nullopt;
  Head head;
  head.kind = in.get<Kind>();
  const auto flags = in.get<std::uint8_t>();
  head.reason = in.get<Reason>();
  head.bytes = in.get<std::uint32_t>();
  head.crc = in.get<std::uint32_t>();
  head.time_us = in.get<std::int64_t>();
  head.number = in.get<std::uint64_t>();
  const auto cycle = in.get<std::uint32_t>();
  if (flags & kHasCycle) head.cycle = cycle;
  const std::uint32_t crc = crc32c(bytes.first(in.position()));
  if (in.get<std::uint32_t>() != crc || head.kind == Kind{} || head.bytes > kMaxFrameBytes) return std::nullopt;
  return head;
}

std::size_t find_sync(ByteSpan bytes, std::size_t from) {
  return std::min(text_of(bytes).find(kSync, from), bytes.size());
}

Bytes encode_header(const RawLogHeader& header) {
  ByteWriter out;
  for (const std::string* name : {&header.vendor, &header.model, &header.serial})
    out.put_string(std::string_view(*name).substr(0, kMaxName));
  out.put(static_cast<std::int32_t>(header.layout.width));
  out.put(static_cast<std::int32_t>(header.layout.height));
  out.put(header.layout.first_byte);
  out.put(header.layout.filter);
  out.put(header.embedded);
  out.put(header.rate_hz);
  if (header.calibration) out.put_bytes(encode_calibration(*header.calibration));
  return out.take();
}

Result<RawLogHeader> decode_header(const Head& head, ByteSpan body) {
  ByteReader in(body);
  RawLogHeader header;
  header.begun_us = head.time_us;
  for (std::string* name : {&header.vendor, &header.model, &header.serial}) *name = in.get_string();
  header.layout.width = in.get<std::int32_t>();
  header.layout.height = in.get<std::int32_t>();
  header.layout.first_byte = in.get<FirstByte>();
  header.layout.filter = in.get<ColourFilter>();
  header.embedded = in.get<std::uint32_t>();
  header.rate_hz = in.get<double>();
  if (!in.ok() || crc32c(body) != head.crc) return {Reason::CORRUPT, "its header is damaged"};
  const StereoLayout& layout = header.layout;
  if (layout.width <= 0 || layout.height <= 0 || layout.width > kMaxFrameSide || layout.height > kMaxFrameSide ||
      layout.bytes() > kMaxFrameBytes)
    return {Reason::BAD_SIZE,
            "frames of " + std::to_string(layout.width) + " x " + std::to_string(layout.height) + " pixels"};
  if (layout.first_byte > FirstByte::kRight || layout.filter > ColourFilter::kBGGR || !std::isfinite(header.rate_hz))
    return {Reason::CORRUPT, "its header is of no camera"};
  if (in.at_end()) return header;
  auto calibration = decode_calibration(in.get_bytes(in.remaining()));
  if (!calibration.ok()) return calibration.status();
  header.calibration = *calibration;
  return header;
}

}  // namespace raw_log

}  // namespace relmap::capture
