#include "proto/keyframe/extension_codec.h"

#include <algorithm>
#include <string>
#include <utility>

#include "proto/calibration/calibration_bytes.h"
#include "proto/keyframe/keyframe.h"

namespace relmap {
namespace {

constexpr std::size_t kCountBytes = 2;
constexpr std::size_t kHeadBytes = 4 + 4;  // tag, length

constexpr std::uint32_t kRawCalibration = 21;  // tag in a session's header

auto place_of(Extensions& extensions, std::uint32_t tag) {
  return std::lower_bound(extensions.begin(), extensions.end(), tag,
                          [](const Extension& extension, std::uint32_t value) { return extension.tag < value; });
}

Status too_many(std::size_t count) {
  return {Reason::BAD_SIZE, std::to_string(count) + " extensions; at most " + std::to_string(kMaxExtensions)};
}

Status too_large(std::size_t bytes) {
  return {Reason::BAD_SIZE,
          std::to_string(bytes) + " bytes of extensions; at most " + std::to_string(kMaxExtensionBytes)};
}

}  // namespace

std::size_t extension_bytes(const Extensions& extensions) {
  std::size_t bytes = kCountBytes;
  for (const Extension& extension : extensions) bytes += kHeadBytes + extension.bytes.size();
  return bytes;
}

Status check_extensions(const Extensions& extensions) {
  if (extensions.size() > kMaxExtensions) return too_many(extensions.size());
  if (const std::size_t bytes = extension_bytes(extensions); bytes > kMaxExtensionBytes) return too_large(bytes);
  std::uint32_t before = 0;
  for (const Extension& extension : extensions) {
    if (extension.tag <= before) return {Reason::CORRUPT, "tags of extensions do not ascend"};
    before = extension.tag;
  }
  return {};
}

void put_extensions(ByteWriter& w, const Extensions& extensions) {
  w.put(static_cast<std::uint16_t>(extensions.size()));
  for (const Extension& extension : extensions) {
    w.put(extension.tag);
    w.put(static_cast<std::uint32_t>(extension.bytes.size()));
    w.put_bytes(extension.bytes);
  }
}

Result<Extensions> read_extensions(ByteReader& r) {
  Extensions extensions;
  const std::size_t count = r.get<std::uint16_t>();
  if (count > kMaxExtensions) return too_many(count);
  std::size_t bytes = kCountBytes;
  for (std::size_t i = 0; i < count && r.ok(); ++i) {
    const auto tag = r.get<std::uint32_t>();
    const auto length = r.get<std::uint32_t>();
    bytes += kHeadBytes + std::size_t{length};
    if (bytes > kMaxExtensionBytes) return too_large(bytes);
    const ByteSpan body = r.get_bytes(length);
    extensions.push_back({tag, {body.begin(), body.end()}});
  }
  if (!r.ok()) return Status(Reason::TRUNCATED, "extensions end early");
  if (Status status = check_extensions(extensions); !status.ok()) return status;
  return extensions;
}

Extensions get_extensions(ByteReader& r) {
  if (auto extensions = read_extensions(r); extensions.ok()) return std::move(*extensions);
  (void)r.get_bytes(r.remaining() + 1);
  return {};
}

std::optional<Bytes> take_extension(Extensions& extensions, std::uint32_t tag) {
  const auto found = place_of(extensions, tag);
  if (found == extensions.end() || found->tag != tag) return std::nullopt;
  Bytes bytes = std::move(found->bytes);
  extensions.erase(found);
  return bytes;
}

void add_extension(Extensions& extensions, std::uint32_t tag, Bytes bytes) {
  const auto place = place_of(extensions, tag);
  if (place != extensions.end() && place->tag == tag)
    place->bytes = std::move(bytes);
  else
    extensions.insert(place, {tag, std::move(bytes)});
}

std::size_t heap_bytes(const Extensions& extensions) {
  constexpr std::size_t kAllocation = 16;
  std::size_t bytes = extensions.capacity() == 0 ? 0 : extensions.capacity() * sizeof(Extension) + kAllocation;
  for (const Extension& extension : extensions) bytes += extension.bytes.capacity() + kAllocation;
  return bytes;
}

Extensions header_extensions(const SessionHeader& header) {
  Extensions all = header.unknown;
  if (header.raw) add_extension(all, kRawCalibration, encode_calibration(*header.raw));
  return all;
}

bool set_header_extensions(SessionHeader& header, Extensions all) {
  const auto raw = take_extension(all, kRawCalibration);
  header.unknown = std::move(all);
  if (!raw) return true;
  auto calibration = decode_calibration(*raw);
  if (!calibration.ok()) return false;
  header.raw = std::move(*calibration);
  return true;
}

}  // namespace relmap
