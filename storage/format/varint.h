// Numbers in as few bytes as they need, for parts of the map (docs/storage-format.md): small integers, identities near
// the frame that holds them, and estimates at the precision at which they are kept (storage/graph/precision.h). Nothing
// is lost: what is not at that precision is written in full.
#pragma once

#include "proto/base/bytes.h"
#include "proto/base/ids.h"
#include "proto/geometry/geometry.h"

namespace relmap::storage::varint {

void put_unsigned(ByteWriter& w, std::uint64_t value);  // seven bits a byte, low ones first
std::uint64_t get_unsigned(ByteReader& r);
void put_signed(ByteWriter& w, std::int64_t value);
std::int64_t get_signed(ByteReader& r);

// A count of items that take at least a byte each. If they cannot fit into what is left, all further reads fail.
std::size_t get_count(ByteReader& r);

// Identities are written relative to the frame `near`.
void put(ByteWriter& w, FrameId id, FrameId near);
FrameId get_frame(ByteReader& r, FrameId near);
void put(ByteWriter& w, EdgeId id, FrameId near);
EdgeId get_edge(ByteReader& r, FrameId near);
void put(ByteWriter& w, LandmarkId id, FrameId near);
LandmarkId get_landmark(ByteReader& r, FrameId near);

void put(ByteWriter& w, const SE3& T);
SE3 get_se3(ByteReader& r);

// `known` is a matrix that the reader has already. If `m` equals it, `m` takes one byte.
void put(ByteWriter& w, const Matrix6& m, const Matrix6& known);
Matrix6 get_matrix6(ByteReader& r, const Matrix6& known);

}  // namespace relmap::storage::varint
