// The bytes of extensions (docs/storage-format.md, Extensions): u16 count, then of each, ascending by tag: u32 tag,
// u32 length, bytes. A record's own fields of later versions stand among those that this version does not know.
#pragma once

#include <cstdint>
#include <optional>

#include "proto/base/status.h"
#include "proto/keyframe/extensions.h"

namespace relmap {

// Of one record. What is unknown is held in memory and written again, so it has to be little.
inline constexpr std::size_t kMaxExtensions = 32;
inline constexpr std::size_t kMaxExtensionBytes = 4096;  // as bytes, tags and lengths included

std::size_t extension_bytes(const Extensions& extensions);
// BAD_SIZE: more than a record may have. CORRUPT: tags are zero or do not ascend.
Status check_extensions(const Extensions& extensions);

void put_extensions(ByteWriter& w, const Extensions& extensions);
// TRUNCATED, or what check_extensions() says of them.
Result<Extensions> read_extensions(ByteReader& r);
// The same, where a failure spends the reader.
Extensions get_extensions(ByteReader& r);

// A field that this version knows leaves its record's extensions when they are read, and joins them when they are
// written.
std::optional<Bytes> take_extension(Extensions& extensions, std::uint32_t tag);
void add_extension(Extensions& extensions, std::uint32_t tag, Bytes bytes);

// What they hold beyond their own size, for the budget.
std::size_t heap_bytes(const Extensions& extensions);

}  // namespace relmap
