#include "storage/format/frame_codec.h"

#include <zstd.h>

#include <algorithm>
#include <bit>
#include <memory>

#include "proto/keyframe/extension_codec.h"
#include "storage/format/extension_tags.h"
#include "storage/format/varint.h"
#include "storage/graph/precision.h"

namespace relmap::storage {
namespace {

using varint::get_count;
using varint::get_unsigned;
using varint::put_unsigned;

// A field added to one of these must be added here, to random_frames.cc and to the tests, and the version raised.
static_assert(sizeof(Edge) == 1104 && sizeof(Landmark) == 88 && sizeof(FrameHot) == 288 && sizeof(Observation) == 40);

constexpr std::size_t kMaxColdBytes = std::size_t{1} << 20;

// Flags are a byte; bits that mean nothing yet are zero.
template <typename... Bits>
std::uint8_t flags(Bits... bits) {
  std::uint8_t byte = 0;
  int position = 0;
  ((byte |= static_cast<std::uint8_t>(static_cast<bool>(bits) << position++)), ...);
  return byte;
}
bool flag(std::uint8_t byte, int position) { return (byte >> position) & 1; }

template <typename Enum>
void put_pair(ByteWriter& w, Enum low, auto high) {
  w.put(static_cast<std::uint8_t>(static_cast<std::uint8_t>(low) | (static_cast<std::uint8_t>(high) << 4)));
}

// All further reads fail.
void spend(ByteReader& r) { (void)r.get_bytes(r.remaining() + 1); }

std::uint32_t get_u32(ByteReader& r) { return static_cast<std::uint32_t>(get_unsigned(r)); }

// Ascending ids lie near each other, so each is written relative to the one before.
FrameId frame_of(FrameId id) { return id; }
FrameId frame_of(EdgeId id) { return id.frame; }

template <typename Id>
void put_ids(ByteWriter& w, const std::vector<Id>& ids, FrameId near) {
  put_unsigned(w, ids.size());
  for (const Id& id : ids) {
    varint::put(w, id, near);
    near = frame_of(id);
  }
}

FrameId get_id(ByteReader& r, FrameId near, FrameId*) { return varint::get_frame(r, near); }
EdgeId get_id(ByteReader& r, FrameId near, EdgeId*) { return varint::get_edge(r, near); }

template <typename Id>
void get_ids(ByteReader& r, std::vector<Id>& ids, FrameId near) {
  const std::size_t count = get_count(r);
  ids.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    ids.push_back(get_id(r, near, static_cast<Id*>(nullptr)));
    near = frame_of(ids.back());
  }
}

bool has_evidence(const Edge& e) {
  return e.verification != Verification::kNone || e.inliers != 0 || e.bound != 0 ||
         std::bit_cast<std::uint32_t>(e.probability) != 0 || std::bit_cast<std::uint32_t>(e.spread) != 0 ||
         !e.bound_frames.empty() || !e.consistent_with.empty();
}

Extensions edge_extensions(const Edge& e) {
  Extensions all = e.unknown;
  tags::add_uniqueness(all, e.uniqueness);
  tags::add_carried(all, e.carried);
  tags::add_closure_tests(all, e.tests);
  tags::add_way_around(all, e.around.get());
  tags::add_unseen(all, e.unseen);
  tags::add_submissions(all, e.history);
  return all;
}

void put_history(ByteWriter& w, const Edge& e) {
  put_unsigned(w, e.history.size());
  std::uint64_t before = 0;
  for (const EdgeEvent& event : e.history) {
    put_unsigned(w, event.journal_sequence - before);
    before = event.journal_sequence;
    w.put(static_cast<std::uint8_t>(event.state));
    put_unsigned(w, static_cast<std::uint64_t>(event.reason));
    varint::put(w, event.cause, e.id.frame);
    w.put_string(event.note);
  }
}

void get_history(ByteReader& r, Edge& e) {
  const std::size_t count = get_count(r);
  e.history.reserve(count);
  std::uint64_t sequence = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sequence += get_unsigned(r);
    const auto state = r.get<EdgeState>();
    const auto reason = static_cast<Reason>(get_unsigned(r));
    const EdgeId cause = varint::get_edge(r, e.id.frame);
    e.history.push_back({sequence, state, reason, cause, r.get_string(), 0, {}});
  }
}

void put_evidence(ByteWriter& w, const Edge& e, FrameId id) {
  put_unsigned(w, e.inliers);
  put_unsigned(w, e.bound);
  w.put(e.probability);
  w.put(e.spread);
  put_ids(w, e.bound_frames, id);
  put_ids(w, e.consistent_with, id);
}

void get_evidence(ByteReader& r, Edge& e, FrameId id) {
  e.inliers = static_cast<std::uint16_t>(get_unsigned(r));
  e.bound = static_cast<std::uint16_t>(get_unsigned(r));
  e.probability = r.get<float>();
  e.spread = r.get<float>();
  get_ids(r, e.bound_frames, id);
  get_ids(r, e.consistent_with, id);
}

void put_edge(ByteWriter& w, const Edge& e, FrameId id) {
  const bool ends_here = e.id.frame == id && e.b == id;
  const bool correlated = !is_zero(e.correlation_with_previous);
  const Extensions extensions = edge_extensions(e);
  w.put(flags(ends_here, e.carries, e.prior_active, has_evidence(e), correlated, !e.history.empty(),
              !e.carried_by.empty(), !extensions.empty()));
  put_pair(w, e.kind, e.state);
  put_pair(w, e.source, e.verification);
  put_unsigned(w, static_cast<std::uint64_t>(e.reason));
  put_unsigned(w, e.id.ordinal);
  if (!ends_here) {
    varint::put(w, e.id.frame, id);
    varint::put(w, e.b, id);
  }
  varint::put(w, e.a, id);
  put_unsigned(w, e.support);
  varint::put(w, e.T_ab);
  varint::put(w, e.prior_T_ab);
  varint::put(w, e.prior_covariance, Matrix6::Identity());
  varint::put(w, e.covariance, e.prior_covariance);
  if (correlated) w.put_array(e.correlation_with_previous.data(), 36);
  w.put(e.driven_s);
  w.put(e.standing_s);
  if (!e.history.empty()) put_history(w, e);
  if (has_evidence(e)) put_evidence(w, e, id);
  if (!e.carried_by.empty()) put_ids(w, e.carried_by, id);
  if (!extensions.empty()) put_extensions(w, extensions);
}

bool is_state(EdgeState state) { return state >= EdgeState::kCandidate && state <= EdgeState::kRemoved; }

bool plausible(const Edge& e) {
  return e.kind >= EdgeKind::kOdometry && e.kind <= EdgeKind::kPrior && is_state(e.state) &&
         is_reason(static_cast<std::uint16_t>(e.reason)) && static_cast<int>(e.source) < kMotionSources &&
         e.verification <= Verification::kCompounded &&
         std::all_of(e.history.begin(), e.history.end(), [](const EdgeEvent& event) {
           return is_state(event.state) && is_reason(static_cast<std::uint16_t>(event.reason));
         });
}

Edge get_edge(ByteReader& r, FrameId id) {
  Edge e;
  const auto byte = r.get<std::uint8_t>();
  e.carries = flag(byte, 1);
  e.prior_active = flag(byte, 2);
  const auto kind = r.get<std::uint8_t>(), source = r.get<std::uint8_t>();
  e.kind = static_cast<EdgeKind>(kind & 15);
  e.state = static_cast<EdgeState>(kind >> 4);
  e.source = static_cast<MotionSource>(source & 15);
  e.verification = static_cast<Verification>(source >> 4);
  e.reason = static_cast<Reason>(get_unsigned(r));
  e.id = {id, get_u32(r)};
  e.b = id;
  if (!flag(byte, 0)) {
    e.id.frame = varint::get_frame(r, id);
    e.b = varint::get_frame(r, id);
  }
  e.a = varint::get_frame(r, id);
  e.support = get_u32(r);
  e.T_ab = varint::get_se3(r);
  e.prior_T_ab = varint::get_se3(r);
  e.prior_covariance = varint::get_matrix6(r, Matrix6::Identity());
  e.covariance = varint::get_matrix6(r, e.prior_covariance);
  if (flag(byte, 4)) r.get_array(e.correlation_with_previous.data(), 36);
  e.driven_s = r.get<float>();
  e.standing_s = r.get<float>();
  if (flag(byte, 5)) get_history(r, e);
  if (flag(byte, 3)) get_evidence(r, e, id);
  if (flag(byte, 6)) get_ids(r, e.carried_by, id);
  if (flag(byte, 7)) {
    e.unknown = get_extensions(r);
    if (!tags::take_uniqueness(e.unknown, e.uniqueness) || !tags::take_carried(e.unknown, e.carried) ||
        !tags::take_closure_tests(e.unknown, e.tests) || !tags::take_way_around(e.unknown, e.around) ||
        !tags::take_unseen(e.unknown, e.unseen) || !tags::take_submissions(e.unknown, e.history))
      spend(r);
  }
  return e;
}

bool single_precision(const std::vector<Landmark>& landmarks) {
  for (const Landmark& l : landmarks)
    for (const double value : {l.abr.x(), l.abr.y(), l.abr.z()})
      if (std::bit_cast<std::uint64_t>(static_cast<double>(static_cast<float>(value))) !=
          std::bit_cast<std::uint64_t>(value))
        return false;
  return true;
}

// Positions first, then what is small and mostly alike.
void put_landmarks(ByteWriter& w, const std::vector<Landmark>& landmarks, FrameId id) {
  put_unsigned(w, landmarks.size());
  if (landmarks.empty()) return;
  const bool single = single_precision(landmarks);
  w.put(flags(single));
  for (const Landmark& l : landmarks) {
    if (!single) {
      w.put_array(l.abr.data(), 3);
      continue;
    }
    for (int i = 0; i < 3; ++i) w.put(static_cast<float>(l.abr[i]));
  }
  std::uint32_t next_track = 0;
  for (const Landmark& l : landmarks) {
    const bool in_order = l.track.sequence == id.index && l.track.index == next_track;
    w.put(flags(l.depth_prior, in_order, !l.claims.empty()));
    if (!in_order) {
      put_unsigned(w, l.track.sequence);
      put_unsigned(w, l.track.index);
    }
    next_track = l.track.index + 1;
    if (!l.claims.empty()) {
      put_unsigned(w, l.claims.size());
      for (const AliasClaim& claim : l.claims) {
        varint::put(w, claim.target, id);
        varint::put(w, claim.closure, id);
      }
    }
    put_ids(w, l.observers, id);
  }
}

void get_landmarks(ByteReader& r, std::vector<Landmark>& landmarks, FrameId id) {
  const std::size_t count = get_count(r);
  if (count == 0) return;
  const bool single = flag(r.get<std::uint8_t>(), 0);
  if (!r.fits(count, 3 * (single ? sizeof(float) : sizeof(double)))) return spend(r);
  landmarks.resize(count);
  for (Landmark& l : landmarks) {
    if (!single) {
      r.get_array(l.abr.data(), 3);
      continue;
    }
    for (int i = 0; i < 3; ++i) l.abr[i] = r.get<float>();
  }
  std::uint32_t next_track = 0;
  for (Landmark& l : landmarks) {
    const auto byte = r.get<std::uint8_t>();
    l.depth_prior = flag(byte, 0);
    l.track = {id.index, next_track};
    if (!flag(byte, 1)) {
      l.track.sequence = get_u32(r);
      l.track.index = get_u32(r);
    }
    next_track = l.track.index + 1;
    if (flag(byte, 2)) {
      const std::size_t claims = get_count(r);
      l.claims.reserve(claims);
      for (std::size_t i = 0; i < claims; ++i) {
        AliasClaim claim;
        claim.target = varint::get_landmark(r, id);
        claim.closure = varint::get_edge(r, id);
        l.claims.push_back(claim);
      }
    }
    get_ids(r, l.observers, id);
    if (!r.ok()) return;
  }
}

constexpr std::uint8_t kLevelInFlags = 31;  // the level follows in a byte of its own
constexpr std::uint8_t kAlignedObservation = 0x80;
constexpr std::uint32_t kMono = 0x7fc00000;  // a quiet NaN

void put_observation(ByteWriter& w, const Observation& o, FrameId id) {
  const bool bound = o.origin != EdgeId();
  const bool mono = std::bit_cast<std::uint32_t>(o.u_right) == kMono;
  const std::uint8_t level = std::min(o.level, kLevelInFlags);
  w.put(static_cast<std::uint8_t>(flags(bound, mono) | (level << 2) | (o.aligned ? kAlignedObservation : 0)));
  if (level == kLevelInFlags) w.put(o.level);
  varint::put(w, o.landmark, id);
  if (bound) varint::put(w, o.origin, id);
  w.put(o.u_left);
  w.put(o.v);
  if (!mono) w.put(o.u_right);
}

Observation get_observation(ByteReader& r, FrameId id) {
  Observation o;
  const auto byte = r.get<std::uint8_t>();
  o.level = (byte >> 2) & 31;
  o.aligned = (byte & kAlignedObservation) != 0;
  if (o.level == kLevelInFlags) o.level = r.get<std::uint8_t>();
  o.landmark = varint::get_landmark(r, id);
  if (flag(byte, 0)) o.origin = varint::get_edge(r, id);
  o.u_left = r.get<float>();
  o.v = r.get<float>();
  o.u_right = flag(byte, 1) ? std::bit_cast<float>(kMono) : r.get<float>();
  return o;
}

}  // namespace

void encode_hot(ByteWriter& w, FrameId id, const FrameHot& f) {
  w.put(flags(f.present, !f.unreached.empty(), !f.unknown.empty()));
  w.put(f.time_us);
  put_unsigned(w, f.journal_sequence);
  w.put(f.payload_crc);
  varint::put(w, f.T_odom_frame);
  w.put(f.mean_error);
  put_unsigned(w, f.error_terms);
  put_unsigned(w, f.appearance_count);
  put_unsigned(w, f.next_loop_ordinal);
  put_unsigned(w, f.edges.size());
  for (const Edge& edge : f.edges) put_edge(w, edge, id);
  put_ids(w, f.incoming, id);
  put_landmarks(w, f.landmarks, id);
  if (!f.unreached.empty()) {
    put_unsigned(w, f.unreached.size());
    for (const Unreached& item : f.unreached) {
      put_unsigned(w, item.slot);
      varint::put(w, item.observer, id);
    }
  }
  put_unsigned(w, f.labels.size());
  for (const std::string& label : f.labels) {
    put_unsigned(w, label.size());
    w.put_bytes(as_bytes(label));
  }
  if (!f.unknown.empty()) put_extensions(w, f.unknown);
}

std::optional<FrameHot> decode_hot(ByteSpan body, FrameId id) {
  ByteReader r(body);
  FrameHot f;
  const auto byte = r.get<std::uint8_t>();
  if (byte >> 3) return std::nullopt;
  f.present = flag(byte, 0);
  f.time_us = r.get<std::int64_t>();
  f.journal_sequence = get_unsigned(r);
  f.payload_crc = r.get<std::uint32_t>();
  f.T_odom_frame = varint::get_se3(r);
  f.mean_error = r.get<float>();
  f.error_terms = get_u32(r);
  f.appearance_count = get_u32(r);
  f.next_loop_ordinal = static_cast<std::uint16_t>(get_unsigned(r));
  for (std::size_t left = get_count(r); left > 0; --left) {
    f.edges.push_back(get_edge(r, id));
    if (!r.ok() || !plausible(f.edges.back())) return std::nullopt;
  }
  get_ids(r, f.incoming, id);
  get_landmarks(r, f.landmarks, id);
  if (flag(byte, 1))
    for (std::size_t left = get_count(r); left > 0 && r.ok(); --left) {
      const std::uint32_t slot = get_u32(r);
      f.unreached.push_back({slot, varint::get_frame(r, id)});
    }
  for (std::size_t left = get_count(r); left > 0; --left) {
    const ByteSpan label = r.get_bytes(get_unsigned(r));
    f.labels.emplace_back(label.begin(), label.end());
  }
  if (flag(byte, 2)) f.unknown = get_extensions(r);
  if (!r.at_end()) return std::nullopt;
  return f;
}

void encode_warm(ByteWriter& w, FrameId id, const FrameWarm& f) {
  put_unsigned(w, f.observations.size());
  for (const Observation& observation : f.observations) put_observation(w, observation, id);
}

std::optional<FrameWarm> decode_warm(ByteSpan body, FrameId id) {
  ByteReader r(body);
  FrameWarm f;
  const std::size_t count = get_count(r);
  if (!r.fits(count, 11)) return std::nullopt;  // the smallest: flags, landmark, two coordinates
  f.observations.reserve(count);
  for (std::size_t i = 0; i < count; ++i) f.observations.push_back(get_observation(r, id));
  if (!r.at_end()) return std::nullopt;
  return f;
}

// Descriptors are nine tenths of a cold part, and shrink by a quarter.
void encode_cold(ByteWriter& w, const FrameCold& f) {
  ByteWriter plain;
  put_unsigned(plain, f.appearance.size());
  for (const AppearanceFeature& a : f.appearance) plain.put_array(a.descriptor.data(), a.descriptor.size());
  for (const AppearanceFeature& a : f.appearance) {
    plain.put(a.u);
    plain.put(a.v);
    plain.put(a.disparity);
    plain.put(a.scale);
    plain.put(a.angle);
    plain.put(a.track);
  }
  plain.put_bytes(f.picture);
  // Making a context takes longer than using it.
  static thread_local const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(),
                                                                                            ZSTD_freeCCtx);
  Bytes packed(ZSTD_compressBound(plain.size()));
  const std::size_t size =
      ZSTD_compressCCtx(context.get(), packed.data(), packed.size(), plain.bytes().data(), plain.size(), /*level=*/1);
  if (ZSTD_isError(size)) throw std::bad_alloc();  // the only possible error
  w.put_bytes(ByteSpan(packed).first(size));
}

std::optional<FrameCold> decode_cold(ByteSpan body) {
  const auto size = ZSTD_getFrameContentSize(body.data(), body.size());
  if (size > kMaxColdBytes) return std::nullopt;  // error codes are larger
  Bytes plain(size);
  static thread_local const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(),
                                                                                            ZSTD_freeDCtx);
  if (ZSTD_decompressDCtx(context.get(), plain.data(), plain.size(), body.data(), body.size()) != plain.size())
    return std::nullopt;
  ByteReader r(plain);
  FrameCold f;
  const std::size_t count = get_count(r);
  if (!r.fits(count, sizeof(AppearanceFeature::descriptor) + 5 * sizeof(float) + sizeof(std::int16_t)))
    return std::nullopt;
  f.appearance.resize(count);
  for (AppearanceFeature& a : f.appearance) r.get_array(a.descriptor.data(), a.descriptor.size());
  for (AppearanceFeature& a : f.appearance) {
    a.u = r.get<float>();
    a.v = r.get<float>();
    a.disparity = r.get<float>();
    a.scale = r.get<float>();
    a.angle = r.get<float>();
    a.track = r.get<std::int16_t>();
  }
  const ByteSpan picture = r.get_bytes(r.remaining());
  f.picture = {picture.begin(), picture.end()};
  return f;
}

void encode_words(ByteWriter& w, const std::vector<std::uint32_t>& words) {
  put_unsigned(w, words.size());
  for (const std::uint32_t word : words) put_unsigned(w, word);
}

std::optional<std::vector<std::uint32_t>> decode_words(ByteSpan body) {
  ByteReader r(body);
  std::vector<std::uint32_t> words(get_count(r));
  for (std::uint32_t& word : words) word = get_u32(r);
  if (!r.at_end()) return std::nullopt;
  return words;
}

}  // namespace relmap::storage
