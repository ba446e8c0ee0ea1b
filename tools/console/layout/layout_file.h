// A layout on disk, so that the console shows a large map at once when it starts.
//
// The file: "RMLAYOUT", the format's number and the payload's CRC-32C as u32, the payload's size as u64, the payload.
// Another program's file, one of another format and a damaged one are refused; a layout can always be made again.
#pragma once

#include <memory>
#include <string>

#include "proto/base/bytes.h"
#include "tools/console/layout/map_layout.h"

namespace relmap::console {

inline constexpr std::uint32_t kLayoutFormat = 1;

Bytes encode_layout(const MapLayout& layout);
// CORRUPT: the bytes are no layout, whatever they are; the message says what is wrong. UNSUPPORTED: another format.
Result<MapLayout> decode_layout(ByteSpan bytes);

// The file of a map's layout in a folder.
std::string layout_file(const std::string& folder, const MapIdentity& map);
// Replaces the file atomically, and makes the folder if it is missing; readable by this user only. IO_ERROR.
Status save_layout(const std::string& folder, const MapLayout& layout);
// NO_SUCH_FILE; IO_ERROR; the reasons of decode_layout(); CORRUPT if it is the layout of another map.
Result<MapLayout> load_layout(const std::string& folder, const MapIdentity& map);

}  // namespace relmap::console
