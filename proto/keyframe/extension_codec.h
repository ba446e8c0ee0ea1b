// The bytes of a record's extensions (docs/storage-format.md, Extensions): u16 count, then for each, ascending by tag,
// u32 tag, u32 length, bytes. Fields that were added to a record later and extensions that this version does not know
// stand in one list.
#pragma once

#include <cstdint>
#include <optional>

#include "proto/base/status.h"
#include "proto/keyframe/extensions.h"

namespace relmap {

struct SessionHeader;  // keyframe.h

// Limits for one record. Unknown extensions are kept in memory and written again, so they must be small.
inline constexpr std::size_t kMaxExtensions = 32;
inline constexpr std::size_t kMaxExtensionBytes = 4096;  // encoded, including count, tags and lengths

// The size of the encoded extensions.
std::size_t extension_bytes(const Extensions& extensions);
// BAD_SIZE: above the limits of a record. CORRUPT: a tag is zero, or the tags do not ascend.
Status check_extensions(const Extensions& extensions);

void put_extensions(ByteWriter& w, const Extensions& extensions);
// TRUNCATED, or what check_extensions() answers.
Result<Extensions> read_extensions(ByteReader& r);
// The same, but on failure returns no extensions and leaves `r` not ok().
Extensions get_extensions(ByteReader& r);

// Removes the extension with `tag` and returns its bytes; nothing if there is none. Called after reading, for each
// field that this version knows.
std::optional<Bytes> take_extension(Extensions& extensions, std::uint32_t tag);
// Adds an extension, or replaces the one with `tag`. Called before writing, for each field that this version knows.
void add_extension(Extensions& extensions, std::uint32_t tag, Bytes bytes);

// The heap memory of `extensions`, for the budget.
std::size_t heap_bytes(const Extensions& extensions);

// The extensions of a session's header, wherever it is stored: in keyframes, in the map, in the journal and in a
// robot's spool. They are the fields that this version knows, and header.unknown.
Extensions header_extensions(const SessionHeader& header);
// Sets the fields that this version knows from `all`, and header.unknown to the rest. False: a field is malformed.
bool set_header_extensions(SessionHeader& header, Extensions all);

}  // namespace relmap
