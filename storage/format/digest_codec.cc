#include "storage/format/digest_codec.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "storage/format/sealed.h"
#include "storage/format/varint.h"

namespace relmap::storage {
namespace {

using varint::get_count;
using varint::get_signed;
using varint::get_unsigned;
using varint::put_signed;
using varint::put_unsigned;

// A field added to one of these must be added here, to agree() and to the tests.
static_assert(sizeof(ClosureDigest) == 208 && sizeof(FrameDigest) == 160);

constexpr std::uint8_t kDigestsKind = 8;
constexpr std::uint16_t kDigestsVersion = 1;

// Three numbers with one power of two: q / 2^(kBits - exponent), where the largest |q| lies in [2^(kBits-1), 2^kBits).
constexpr int kBits = 15;
struct Block {
  int exponent = 0;
  std::array<std::int16_t, 3> q{};  // all 0: zero, or not finite

  bool is_zero() const { return q == std::array<std::int16_t, 3>{}; }
};

Block to_block(const Vector3& v, int lowest, int highest) {
  Block block;
  const double largest = v.cwiseAbs().maxCoeff();
  if (!v.allFinite() || !(largest > 0)) return block;
  (void)std::frexp(largest, &block.exponent);
  if (std::ldexp(largest, kBits - block.exponent) >= (1 << kBits) - 0.5) ++block.exponent;  // it would be 2^kBits
  if (block.exponent < lowest) return {};
  block.exponent = std::min(block.exponent, highest);
  constexpr double kMost = (1 << kBits) - 1;
  for (int i = 0; i < 3; ++i)
    block.q[static_cast<std::size_t>(i)] =
        static_cast<std::int16_t>(std::clamp(std::nearbyint(std::ldexp(v[i], kBits - block.exponent)), -kMost, kMost));
  return block;
}

Vector3 from_block(const Block& block) {
  Vector3 v;
  for (int i = 0; i < 3; ++i) v[i] = std::ldexp(block.q[static_cast<std::size_t>(i)], block.exponent - kBits);
  return v;
}

constexpr int kFar = 60;     // translations end at 2^60 m, and below 2^-60 m they are zero
constexpr int kSmall = -62;  // of the parts of a quaternion, which are at most 1
constexpr int kNoTurn = 63;  // in the exponent's place

void put_q(ByteWriter& w, const Block& block) { w.put_array(block.q.data(), block.q.size()); }
void get_q(ByteReader& r, Block& block) { r.get_array(block.q.data(), block.q.size()); }

// i8 exponent and three i16, or i8 -128; then for the rotation u8 with two bits for the part that is left out, the
// largest of (w, x, y, z), and six for the exponent, and the other three parts.
void put_pose(ByteWriter& w, const SE3& T) {
  const Block translation = to_block(T.t, -kFar, kFar);
  if (translation.is_zero()) {
    w.put(std::int8_t{-128});
  } else {
    w.put(static_cast<std::int8_t>(translation.exponent));
    put_q(w, translation);
  }
  const Eigen::Quaterniond quaternion = T.quaternion();
  const double norm = quaternion.norm();
  std::array<double, 4> parts = {quaternion.w(), quaternion.x(), quaternion.y(), quaternion.z()};
  int left_out = 0;
  for (int i = 1; i < 4; ++i)
    if (std::abs(parts[static_cast<std::size_t>(i)]) > std::abs(parts[static_cast<std::size_t>(left_out)]))
      left_out = i;
  const double scale = (parts[static_cast<std::size_t>(left_out)] < 0 ? -1 : 1) / norm;
  Vector3 others;
  for (int i = 0, k = 0; i < 4; ++i)
    if (i != left_out) others[k++] = parts[static_cast<std::size_t>(i)] * scale;
  const Block rotation = to_block(others, kSmall, 0);
  if (!std::isfinite(norm) || rotation.is_zero()) left_out = 0;
  if (rotation.is_zero()) return w.put(static_cast<std::uint8_t>(kNoTurn << 2 | left_out));
  w.put(static_cast<std::uint8_t>(-rotation.exponent << 2 | left_out));
  put_q(w, rotation);
}

SE3 get_pose(ByteReader& r) {
  Block translation, rotation;
  translation.exponent = r.get<std::int8_t>();
  if (translation.exponent != -128) get_q(r, translation);
  const auto form = r.get<std::uint8_t>();
  rotation.exponent = -(form >> 2);
  if (rotation.exponent != -kNoTurn) get_q(r, rotation);
  const Vector3 others = from_block(rotation);
  std::array<double, 4> parts{};
  for (int i = 0, k = 0; i < 4; ++i)
    parts[static_cast<std::size_t>(i)] =
        i == (form & 3) ? std::sqrt(std::max(0.0, 1 - others.squaredNorm())) : others[k++];
  return SE3::from_quaternion({parts[0], parts[1], parts[2], parts[3]}, from_block(translation));
}

// The upper 8 * kBytes bits of a float, rounded.
template <int kBytes>
void put_real(ByteWriter& w, float value) {
  constexpr int kDropped = 32 - 8 * kBytes;
  auto bits = std::bit_cast<std::uint32_t>(value);
  if (std::isfinite(value))
    bits += (std::uint32_t{1} << (kDropped - 1)) - 1 + ((bits >> kDropped) & 1);
  else if (std::isnan(value))
    bits = 0x7fc00000;
  bits >>= kDropped;
  for (int i = 0; i < kBytes; ++i) w.put(static_cast<std::uint8_t>(bits >> (8 * i)));
}
template <int kBytes>
float get_real(ByteReader& r) {
  std::uint32_t bits = 0;
  for (int i = 0; i < kBytes; ++i) bits |= std::uint32_t{r.get<std::uint8_t>()} << (8 * i);
  return std::bit_cast<float>(bits << (32 - 8 * kBytes));
}

template <typename Number>
Number get_as(ByteReader& r) {
  return static_cast<Number>(get_unsigned(r));
}

template <typename... Bits>
std::uint8_t flags_of(Bits... bits) {
  std::uint8_t byte = 0;
  int position = 0;
  ((byte |= static_cast<std::uint8_t>(static_cast<bool>(bits) << position++)), ...);
  return byte;
}

// Of a closure. Maps of earlier builds have it set where an operator ever accepted the closure; it is passed over.
constexpr bool kUnusedFlag = false;

void put_uniqueness(ByteWriter& w, const Uniqueness& u, FrameId near) {
  varint::put(w, u.runner_up, near);
  put_unsigned(w, u.runner_up_inliers);
  put_real<3>(w, u.runner_up_probability);
  put_unsigned(w, u.alike);
  put_real<3>(w, u.differs);
  put_unsigned(w, u.compared);
  put_unsigned(w, u.changed);
}

void get_uniqueness(ByteReader& r, Uniqueness& u, FrameId near) {
  u.known = true;
  u.runner_up = varint::get_frame(r, near);
  u.runner_up_inliers = get_as<std::uint16_t>(r);
  u.runner_up_probability = get_real<3>(r);
  u.alike = get_as<std::uint16_t>(r);
  u.differs = get_real<3>(r);
  u.compared = get_as<std::uint16_t>(r);
  u.changed = get_as<std::uint16_t>(r);
}

void put_tests(ByteWriter& w, const ClosureTests& tests) {
  put_unsigned(w, tests.opposing);
  w.put(static_cast<std::uint8_t>(tests.motion));
  put_real<3>(w, tests.motion_sigma);
}

void get_tests(ByteReader& r, ClosureTests& tests) {
  tests.opposing = get_as<std::uint16_t>(r);
  tests.motion = static_cast<MotionSays>(r.get<std::uint8_t>());
  tests.motion_sigma = get_real<3>(r);
}

void put_closure(ByteWriter& w, FrameId id, const ClosureDigest& c) {
  const bool tested = c.tests != ClosureTests();
  w.put(static_cast<std::uint8_t>(
      flags_of(c.carries, c.was_contradicted, kUnusedFlag, c.carried, c.uniqueness.known, tested) |
      static_cast<std::uint8_t>(c.kind) << 6));
  w.put(static_cast<std::uint8_t>(static_cast<std::uint8_t>(c.state) | (c.looks_alike ? 8 : 0) |
                                  static_cast<std::uint8_t>(c.verification) << 4));
  put_unsigned(w, c.id.ordinal);
  put_unsigned(w, static_cast<std::uint64_t>(c.reason));
  varint::put(w, c.a, id);
  put_pose(w, c.T_ab);
  put_real<3>(w, c.translation_variance);
  put_real<3>(w, c.rotation_variance);
  put_unsigned(w, c.inliers);
  put_unsigned(w, c.bound);
  put_unsigned(w, c.support);
  put_real<3>(w, c.probability);
  put_real<3>(w, c.spread);
  put_unsigned(w, c.agreeing);
  put_unsigned(w, c.unseen);
  put_real<3>(w, c.tension);
  if (c.uniqueness.known) put_uniqueness(w, c.uniqueness, id);
  if (tested) put_tests(w, c.tests);
}

bool get_closure(ByteReader& r, FrameId id, ClosureDigest& c) {
  const auto flags = r.get<std::uint8_t>(), states = r.get<std::uint8_t>();
  c.carries = flags & 1;
  c.was_contradicted = flags & 2;
  c.carried = flags & 8;
  c.kind = static_cast<EdgeKind>(flags >> 6);
  c.state = static_cast<EdgeState>(states & 7);
  c.looks_alike = states & 8;
  c.verification = static_cast<Verification>(states >> 4);
  c.id = {id, get_as<std::uint32_t>(r)};
  const std::uint64_t reason = get_unsigned(r);
  c.reason = static_cast<Reason>(reason);
  c.a = varint::get_frame(r, id);
  c.T_ab = get_pose(r);
  c.translation_variance = get_real<3>(r);
  c.rotation_variance = get_real<3>(r);
  c.inliers = get_as<std::uint16_t>(r);
  c.bound = get_as<std::uint16_t>(r);
  c.support = get_as<std::uint32_t>(r);
  c.probability = get_real<3>(r);
  c.spread = get_real<3>(r);
  c.agreeing = get_as<std::uint16_t>(r);
  c.unseen = get_as<std::uint16_t>(r);
  c.tension = get_real<3>(r);
  c.uniqueness = {};
  if (flags & 16) get_uniqueness(r, c.uniqueness, id);
  c.tests = {};
  if (flags & 32) get_tests(r, c.tests);
  return r.ok() && c.kind >= EdgeKind::kOdometry && c.kind <= EdgeKind::kPrior && c.state >= EdgeState::kCandidate &&
         c.state <= EdgeState::kRemoved && c.verification <= Verification::kCompounded && reason <= 0xffff &&
         is_reason(static_cast<std::uint16_t>(reason)) && c.tests.motion <= MotionSays::kContradicts;
}

void put_entry(ByteWriter& w, FrameId id, std::int64_t time_us, const FrameDigest& d) {
  w.put(static_cast<std::uint8_t>(flags_of(d.joined, d.unmeasured, d.carried, d.labelled) |
                                  static_cast<std::uint8_t>(d.source) << 4));
  put_signed(w, static_cast<std::int64_t>(static_cast<std::uint64_t>(d.time_us) - static_cast<std::uint64_t>(time_us)));
  put_real<2>(w, d.driven_s);
  if (d.joined) {
    put_pose(w, d.T_previous_frame);
    put_real<2>(w, d.translation_variance);
    put_real<2>(w, d.rotation_variance);
  }
  for (const ClosureDigest& closure : d.closures) put_closure(w, id, closure);
}

bool get_entry(ByteSpan entry, FrameId id, std::int64_t time_us, FrameDigest& d) {
  ByteReader r(entry);
  const auto flags = r.get<std::uint8_t>();
  d.slot = slot_of(id);
  d.joined = flags & 1;
  d.unmeasured = flags & 2;
  d.carried = flags & 4;
  d.labelled = flags & 8;
  d.source = static_cast<MotionSource>(flags >> 4);
  d.time_us =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(time_us) + static_cast<std::uint64_t>(get_signed(r)));
  d.driven_s = get_real<2>(r);
  d.T_previous_frame = {};
  d.translation_variance = d.rotation_variance = 0;
  if (d.joined) {
    d.T_previous_frame = get_pose(r);
    d.translation_variance = get_real<2>(r);
    d.rotation_variance = get_real<2>(r);
  }
  d.closures.clear();
  while (r.ok() && !r.at_end())
    if (!get_closure(r, id, d.closures.emplace_back())) return false;
  return r.at_end() && static_cast<int>(d.source) < kMotionSources;
}

bool near(double a, double b, double tolerance) {
  return a == b || (std::isnan(a) && std::isnan(b)) ||
         std::abs(a - b) <= tolerance * std::max(std::abs(a), std::abs(b));
}
bool near(const SE3& a, const SE3& b) {
  constexpr double kTwice = 2.0 / (1 << kBits), kRounding = 1e-14;
  const auto turn = [](const SE3& T) { return (T.R - Matrix3::Identity()).norm(); };
  return (a.t - b.t).cwiseAbs().maxCoeff() <= kTwice * std::max(a.t.cwiseAbs().maxCoeff(), b.t.cwiseAbs().maxCoeff()) &&
         (a.R - b.R).norm() <= 4 * kTwice * std::max(turn(a), turn(b)) + kRounding;
}
constexpr double kMotion = 2.0 / (1 << 8), kEvidence = 2.0 / (1 << 16);
// The root of a difference of two transforms that are all but equal: its last digits depend on the processor.
constexpr double kTension = 1e-3, kNoTension = 1e-3;

bool agree(const Uniqueness& a, const Uniqueness& b) {
  return a.known == b.known && a.runner_up == b.runner_up && a.runner_up_inliers == b.runner_up_inliers &&
         near(a.runner_up_probability, b.runner_up_probability, kEvidence) && a.alike == b.alike &&
         near(a.differs, b.differs, kEvidence) && a.compared == b.compared && a.changed == b.changed;
}

bool agree(const ClosureDigest& a, const ClosureDigest& b) {
  return a.id == b.id && a.a == b.a && a.kind == b.kind && a.state == b.state && a.reason == b.reason &&
         a.verification == b.verification && a.carries == b.carries && near(a.T_ab, b.T_ab) &&
         near(a.translation_variance, b.translation_variance, kEvidence) &&
         near(a.rotation_variance, b.rotation_variance, kEvidence) && a.inliers == b.inliers && a.bound == b.bound &&
         a.support == b.support && near(a.probability, b.probability, kEvidence) &&
         near(a.spread, b.spread, kEvidence) && a.agreeing == b.agreeing && a.unseen == b.unseen &&
         (near(a.tension, b.tension, kTension) || std::max(a.tension, b.tension) < kNoTension) &&
         a.was_contradicted == b.was_contradicted && a.looks_alike == b.looks_alike && a.carried == b.carried &&
         agree(a.uniqueness, b.uniqueness) && a.tests.opposing == b.tests.opposing &&
         a.tests.motion == b.tests.motion && near(a.tests.motion_sigma, b.tests.motion_sigma, kEvidence);
}

}  // namespace

bool agree(const FrameDigest& a, const FrameDigest& b) {
  return a.slot == b.slot && a.time_us == b.time_us && a.joined == b.joined &&
         near(a.T_previous_frame, b.T_previous_frame) &&
         near(a.translation_variance, b.translation_variance, kMotion) &&
         near(a.rotation_variance, b.rotation_variance, kMotion) && near(a.driven_s, b.driven_s, kMotion) &&
         a.unmeasured == b.unmeasured && a.carried == b.carried && a.source == b.source && a.labelled == b.labelled &&
         std::equal(a.closures.begin(), a.closures.end(), b.closures.begin(), b.closures.end(),
                    [](const ClosureDigest& x, const ClosureDigest& y) { return agree(x, y); });
}

FrameDigest as_stored(FrameId id, const FrameDigest& digest) {
  ByteWriter w;
  put_entry(w, id, digest.time_us, digest);
  FrameDigest stored;
  const bool decoded = get_entry(w.bytes(), id, digest.time_us, stored);
  assert(decoded);
  (void)decoded;
  return stored;
}

void DigestWriter::add(const FrameDigest& digest) {
  ByteWriter entry;
  put_entry(entry, frame_in(id_, digest.slot), time_us_, digest);
  copy(digest.slot, entry.bytes(), !digest.closures.empty());
}

void DigestWriter::copy(std::uint32_t slot, ByteSpan entry, bool closures) {
  assert(slot < kFramesPerChunk && slots_ >> slot == 0 && !entry.empty());
  slots_ |= std::uint64_t{1} << slot;
  closures_ |= std::uint64_t{closures} << slot;
  put_unsigned(entries_, entry.size());
  entries_.put_bytes(entry);
}

Bytes DigestWriter::finish() const {
  ByteWriter w;
  w.reserve(32 + entries_.size());
  w.put(id_.session);
  w.put(id_.chunk);
  w.put(time_us_);
  w.put(slots_);
  w.put(closures_);
  w.put_bytes(entries_.bytes());
  return seal(kDigestsKind, kDigestsVersion, w.bytes());
}

Result<PackedDigests> unpack_digests(ByteSpan record, ChunkId id) {
  const auto sealed = unseal(record, kDigestsVersion, kDigestsVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  const ChunkId stored{r.get<std::uint32_t>(), r.get<std::uint32_t>()};
  PackedDigests packed;
  packed.time_us = r.get<std::int64_t>();
  const auto slots = r.get<std::uint64_t>();
  packed.closures = r.get<std::uint64_t>();
  if (sealed->kind != kDigestsKind || !r.ok()) return Status(Reason::CORRUPT, "malformed digests");
  if (stored != id)
    return Status(Reason::CORRUPT,
                  "digests of chunk " + stored.to_string() + " where those of " + id.to_string() + " belong");
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (!((slots >> slot) & 1)) continue;
    packed.entries[slot] = r.get_bytes(get_count(r));
    if (packed.entries[slot].empty()) return Status(Reason::CORRUPT, "malformed digests");
  }
  if (!r.at_end() || (packed.closures & ~slots) != 0) return Status(Reason::CORRUPT, "malformed digests");
  return packed;
}

Status decode_digests(ByteSpan record, ChunkId id, ChunkDigest& digests, DigestsOf which) {
  const auto packed = unpack_digests(record, id);
  if (!packed.ok()) return packed.status();
  digests.id = id;
  std::size_t count = 0;
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (packed->entries[slot].empty() || (which == DigestsOf::kClosures && !packed->has_closures(slot))) continue;
    if (count == digests.frames.size()) digests.frames.emplace_back();
    FrameDigest& frame = digests.frames[count++];
    if (!get_entry(packed->entries[slot], frame_in(id, slot), packed->time_us, frame) ||
        frame.closures.empty() == packed->has_closures(slot))
      return Status(Reason::CORRUPT, "digest of frame " + frame_in(id, slot).to_string());
  }
  digests.frames.resize(count);
  return {};
}

}  // namespace relmap::storage
