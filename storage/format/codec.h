// What the storage codecs share: identities and transforms as bytes, and tables whose items can grow.
#pragma once

#include "proto/base/bytes.h"
#include "proto/base/ids.h"
#include "proto/base/reason.h"
#include "proto/geometry/geometry.h"

namespace relmap::storage::codec {

inline void put(ByteWriter& w, FrameId id) {
  w.put(id.session);
  w.put(id.index);
}
inline FrameId get_frame(ByteReader& r) {
  FrameId id;
  id.session = r.get<std::uint32_t>();
  id.index = r.get<std::uint32_t>();
  return id;
}

inline void put(ByteWriter& w, EdgeId id) {
  put(w, id.frame);
  w.put(id.ordinal);
}
inline EdgeId get_edge(ByteReader& r) {
  EdgeId id;
  id.frame = get_frame(r);
  id.ordinal = r.get<std::uint32_t>();
  return id;
}

inline void put(ByteWriter& w, LandmarkId id) {
  put(w, id.base);
  w.put(id.slot);
}
inline LandmarkId get_landmark(ByteReader& r) {
  LandmarkId id;
  id.base = get_frame(r);
  id.slot = r.get<std::uint32_t>();
  return id;
}

// The matrix itself, not a quaternion: a reload must give the same bits.
inline void put(ByteWriter& w, const SE3& T) {
  w.put_array(T.R.data(), 9);
  w.put_array(T.t.data(), 3);
}
inline SE3 get_se3(ByteReader& r) {
  SE3 T;
  r.get_array(T.R.data(), 9);
  r.get_array(T.t.data(), 3);
  return T;
}

inline void put(ByteWriter& w, const Matrix6& m) { w.put_array(m.data(), 36); }
inline Matrix6 get_matrix6(ByteReader& r) {
  Matrix6 m;
  r.get_array(m.data(), 36);
  return m;
}

inline void put_long_string(ByteWriter& w, std::string_view text) {  // u32 length, then the bytes
  w.put(static_cast<std::uint32_t>(text.size()));
  w.put_bytes(as_bytes(text));
}
inline std::string get_long_string(ByteReader& r) {
  const auto bytes = r.get_bytes(r.get<std::uint32_t>());
  return {bytes.begin(), bytes.end()};
}

// u32 length, then the bytes.
inline void put_blob(ByteWriter& w, ByteSpan bytes) {
  w.put(static_cast<std::uint32_t>(bytes.size()));
  w.put_bytes(bytes);
}
inline Bytes get_blob(ByteReader& r) {
  const auto bytes = r.get_bytes(r.get<std::uint32_t>());
  return {bytes.begin(), bytes.end()};
}

// A table is u32 count, u16 bytes per item, and the items. A later version may append fields to an item; a reader that
// does not know them skips them.
template <typename Items, typename PutItem>
void put_table(ByteWriter& w, const Items& items, PutItem put_item) {
  w.put(static_cast<std::uint32_t>(items.size()));
  const std::size_t stride_at = w.size();
  w.put(std::uint16_t{0});
  std::size_t before = w.size();
  for (const auto& item : items) {
    put_item(w, item);
    w.patch(stride_at, static_cast<std::uint16_t>(w.size() - before));
    before = w.size();
  }
}

// `get_item(reader) -> item` reads one item; false if the table is not whole.
template <typename Items, typename GetItem>
bool get_table(ByteReader& r, Items& items, GetItem get_item) {
  const auto count = r.get<std::uint32_t>();
  const auto stride = r.get<std::uint16_t>();
  if (!r.ok() || (count > 0 && stride == 0) || !r.fits(count, stride)) return false;
  for (std::uint32_t i = 0; i < count; ++i) {
    ByteReader item(r.get_bytes(stride));
    items.push_back(get_item(item));
    if (!item.ok()) return false;
    if (i == 0) items.reserve(count);  // only once an item is known to fit the stride
  }
  return true;
}

inline bool get_bool(ByteReader& r) { return r.get<std::uint8_t>() != 0; }
inline void put_bool(ByteWriter& w, bool value) { w.put(static_cast<std::uint8_t>(value ? 1 : 0)); }

}  // namespace relmap::storage::codec
