#include "storage/format/varint.h"

#include <cstring>

#include "storage/graph/precision.h"

namespace relmap::storage::varint {

namespace {

constexpr std::uint8_t kFullPose = 0;  // otherwise 1 + PoseGrid::left_out

enum class MatrixForm : std::uint8_t { kFull = 0, kZero = 1, kKnown = 2, kSingle = 3 };  // single: 21 floats

template <typename T>
bool same_bits(const T& a, const T& b) {  // -0 differs from 0, NaN equals itself
  return std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

// Whether the matrix is symmetric and made of floats, bit for bit.
bool made_of_floats(const Matrix6& m) {
  Matrix6 kept;
  for (int column = 0; column < 6; ++column)
    for (int row = column; row < 6; ++row) kept(row, column) = kept(column, row) = static_cast<float>(m(row, column));
  return kept.allFinite() && same_bits(m, kept);
}

// 0, -1, 1, -2 ... become 0, 1, 2, 3 ...: small numbers stay small whatever their sign.
std::uint64_t zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
std::int64_t unzigzag(std::uint64_t value) { return static_cast<std::int64_t>((value >> 1) ^ (0 - (value & 1))); }

}  // namespace

void put_unsigned(ByteWriter& w, std::uint64_t value) {
  while (value >= 0x80) {
    w.put(static_cast<std::uint8_t>(value | 0x80));
    value >>= 7;
  }
  w.put(static_cast<std::uint8_t>(value));
}

std::uint64_t get_unsigned(ByteReader& r) {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const auto byte = r.get<std::uint8_t>();
    value |= std::uint64_t{byte & 0x7fU} << shift;
    if (byte < 0x80) break;
  }
  return value;
}

void put_signed(ByteWriter& w, std::int64_t value) { put_unsigned(w, zigzag(value)); }

std::int64_t get_signed(ByteReader& r) { return unzigzag(get_unsigned(r)); }

std::size_t get_count(ByteReader& r) {
  const std::uint64_t count = get_unsigned(r);
  if (r.fits(count, 1)) return count;
  r.get_bytes(r.remaining() + 1);
  return 0;
}

// Within a session an even number, from the distance; otherwise an odd number, from the session, and the index.
void put(ByteWriter& w, FrameId id, FrameId near) {
  if (id.session == near.session) {
    put_unsigned(w, zigzag(std::int64_t{id.index} - std::int64_t{near.index}) << 1);
  } else {
    put_unsigned(w, (std::uint64_t{id.session} << 1) | 1);
    put_unsigned(w, id.index);
  }
}

FrameId get_frame(ByteReader& r, FrameId near) {
  const std::uint64_t first = get_unsigned(r);
  if (first & 1) return {static_cast<SessionNumber>(first >> 1), static_cast<std::uint32_t>(get_unsigned(r))};
  return {near.session, static_cast<std::uint32_t>(near.index + unzigzag(first >> 1))};
}

void put(ByteWriter& w, EdgeId id, FrameId near) {
  put(w, id.frame, near);
  put_unsigned(w, id.ordinal);
}

EdgeId get_edge(ByteReader& r, FrameId near) {
  EdgeId id;
  id.frame = get_frame(r, near);
  id.ordinal = static_cast<std::uint32_t>(get_unsigned(r));
  return id;
}

void put(ByteWriter& w, LandmarkId id, FrameId near) {
  put(w, id.base, near);
  put_unsigned(w, id.slot);
}

LandmarkId get_landmark(ByteReader& r, FrameId near) {
  LandmarkId id;
  id.base = get_frame(r, near);
  id.slot = static_cast<std::uint32_t>(get_unsigned(r));
  return id;
}

void put(ByteWriter& w, const SE3& T) {
  const auto grid = to_grid(T);
  const SE3 back = grid ? from_grid(*grid) : T;
  if (grid && same_bits(back.R, T.R) && same_bits(back.t, T.t)) {
    w.put(static_cast<std::uint8_t>(1 + grid->left_out));
    for (const std::int64_t value : grid->rotation) put_signed(w, value);
    for (const std::int64_t value : grid->translation) put_signed(w, value);
  } else {
    w.put(kFullPose);
    w.put_array(T.R.data(), 9);
    w.put_array(T.t.data(), 3);
  }
}

SE3 get_se3(ByteReader& r) {
  const auto form = r.get<std::uint8_t>();
  if (form != kFullPose) {
    PoseGrid grid;
    grid.left_out = (form - 1) & 3;
    for (std::int64_t& value : grid.rotation) value = get_signed(r);
    for (std::int64_t& value : grid.translation) value = get_signed(r);
    return from_grid(grid);
  }
  SE3 T;
  r.get_array(T.R.data(), 9);
  r.get_array(T.t.data(), 3);
  return T;
}

void put(ByteWriter& w, const Matrix6& m, const Matrix6& known) {
  if (same_bits(m, known)) return w.put(MatrixForm::kKnown);
  if (same_bits(m, Matrix6(Matrix6::Zero()))) return w.put(MatrixForm::kZero);
  if (!made_of_floats(m)) {
    w.put(MatrixForm::kFull);
    return w.put_array(m.data(), 36);
  }
  w.put(MatrixForm::kSingle);
  for (int column = 0; column < 6; ++column)
    for (int row = column; row < 6; ++row) w.put(static_cast<float>(m(row, column)));
}

Matrix6 get_matrix6(ByteReader& r, const Matrix6& known) {
  Matrix6 m = Matrix6::Zero();
  switch (r.get<MatrixForm>()) {
    case MatrixForm::kKnown:
      return known;
    case MatrixForm::kSingle:
      for (int column = 0; column < 6; ++column)
        for (int row = column; row < 6; ++row) m(row, column) = m(column, row) = r.get<float>();
      break;
    case MatrixForm::kFull:
      r.get_array(m.data(), 36);
      break;
    case MatrixForm::kZero:
      break;
  }
  return m;
}

}  // namespace relmap::storage::varint
