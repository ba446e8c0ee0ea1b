#include "storage/migrate/format1.h"

#include "storage/format/codec.h"
#include "storage/format/sealed.h"
#include "storage/format/state_codec.h"

namespace relmap::storage::format1 {
namespace {

using codec::get_table;

// Of the records of sessions and of the map's state.
constexpr std::uint16_t kVersion = 1;
constexpr std::uint8_t kSession = 1, kState = 2;

struct EdgeItem {
  Edge edge;
  std::uint32_t bound = 0, consistent = 0;
};

EdgeItem get_edge_item(ByteReader& r) {
  EdgeItem item;
  Edge& e = item.edge;
  e.id = codec::get_edge(r);
  e.a = codec::get_frame(r);
  e.b = codec::get_frame(r);
  e.kind = r.get<EdgeKind>();
  e.state = r.get<EdgeState>();
  e.reason = r.get<Reason>();
  e.source = r.get<MotionSource>();
  e.carries = codec::get_bool(r);
  e.prior_active = codec::get_bool(r);
  e.verification = r.get<Verification>();
  e.support = r.get<std::uint32_t>();
  e.T_ab = codec::get_se3(r);
  e.covariance = codec::get_matrix6(r);
  e.prior_T_ab = codec::get_se3(r);
  e.prior_covariance = codec::get_matrix6(r);
  e.driven_s = r.get<float>();
  e.standing_s = r.get<float>();
  e.inliers = r.get<std::uint16_t>();
  e.bound = r.get<std::uint16_t>();
  e.probability = r.get<float>();
  e.spread = r.get<float>();
  item.bound = r.get<std::uint32_t>();
  item.consistent = r.get<std::uint32_t>();
  return item;
}

bool plausible(const Edge& e) {
  return e.kind >= EdgeKind::kOdometry && e.kind <= EdgeKind::kPrior && e.state >= EdgeState::kCandidate &&
         e.state <= EdgeState::kRemoved && is_reason(static_cast<std::uint16_t>(e.reason)) &&
         static_cast<int>(e.source) < kMotionSources && e.verification <= Verification::kEpipolar;
}

struct LandmarkItem {
  Landmark landmark;
  std::uint32_t claims = 0, observers = 0;
};

LandmarkItem get_landmark_item(ByteReader& r) {
  LandmarkItem item;
  r.get_array(item.landmark.abr.data(), 3);
  item.landmark.track.sequence = r.get<std::uint32_t>();
  item.landmark.track.index = r.get<std::uint32_t>();
  item.landmark.depth_prior = codec::get_bool(r);
  item.claims = r.get<std::uint32_t>();
  item.observers = r.get<std::uint32_t>();
  return item;
}

// Copies the next `count` items of `from`; false if there are fewer.
template <typename T>
bool take(const std::vector<T>& from, std::size_t& next, std::size_t count, std::vector<T>& to) {
  if (count > from.size() - next) return false;
  to.assign(from.begin() + static_cast<std::ptrdiff_t>(next), from.begin() + static_cast<std::ptrdiff_t>(next + count));
  next += count;
  return true;
}

}  // namespace

std::optional<FrameHot> decode_hot(ByteSpan body) {
  ByteReader r(body);
  FrameHot f;
  f.present = codec::get_bool(r);
  f.time_us = r.get<std::int64_t>();
  f.journal_sequence = r.get<std::uint64_t>();
  f.payload_crc = r.get<std::uint32_t>();
  f.T_odom_frame = codec::get_se3(r);
  f.mean_error = r.get<float>();
  f.error_terms = r.get<std::uint32_t>();
  f.appearance_count = r.get<std::uint32_t>();
  f.next_loop_ordinal = r.get<std::uint16_t>();

  std::vector<EdgeItem> edges;
  std::vector<FrameId> bound;
  std::vector<EdgeId> consistent;
  std::vector<LandmarkItem> landmarks;
  std::vector<AliasClaim> claims;
  std::vector<FrameId> observers;
  if (!get_table(r, edges, get_edge_item) || !get_table(r, bound, codec::get_frame) ||
      !get_table(r, consistent, codec::get_edge) || !get_table(r, f.incoming, codec::get_edge) ||
      !get_table(r, landmarks, get_landmark_item) ||
      !get_table(r, claims,
                 [](ByteReader& in) {
                   AliasClaim claim;
                   claim.target = codec::get_landmark(in);
                   claim.closure = codec::get_edge(in);
                   return claim;
                 }) ||
      !get_table(r, observers, codec::get_frame))
    return std::nullopt;

  std::size_t next_bound = 0, next_consistent = 0, next_claim = 0, next_observer = 0;
  f.edges.reserve(edges.size());
  for (EdgeItem& item : edges) {
    if (!plausible(item.edge) || !take(bound, next_bound, item.bound, item.edge.bound_frames) ||
        !take(consistent, next_consistent, item.consistent, item.edge.consistent_with))
      return std::nullopt;
    f.edges.push_back(std::move(item.edge));
  }
  f.landmarks.reserve(landmarks.size());
  for (LandmarkItem& item : landmarks) {
    if (!take(claims, next_claim, item.claims, item.landmark.claims) ||
        !take(observers, next_observer, item.observers, item.landmark.observers))
      return std::nullopt;
    f.landmarks.push_back(std::move(item.landmark));
  }
  if (next_bound != bound.size() || next_consistent != consistent.size() || next_claim != claims.size() ||
      next_observer != observers.size())
    return std::nullopt;

  const auto labels = r.get<std::uint32_t>();
  if (!r.fits(labels, sizeof(std::uint32_t))) return std::nullopt;
  f.labels.reserve(labels);
  for (std::uint32_t i = 0; i < labels; ++i) f.labels.push_back(codec::get_long_string(r));
  if (!r.at_end()) return std::nullopt;
  return f;
}

std::optional<FrameWarm> decode_warm(ByteSpan body) {
  ByteReader r(body);
  FrameWarm f;
  const bool whole = get_table(r, f.observations, [](ByteReader& in) {
    Observation o;
    o.landmark = codec::get_landmark(in);
    o.origin = codec::get_edge(in);
    o.u_left = in.get<float>();
    o.v = in.get<float>();
    o.u_right = in.get<float>();
    o.level = in.get<std::uint8_t>();
    return o;
  });
  if (!whole || !r.at_end()) return std::nullopt;
  return f;
}

std::optional<FrameCold> decode_cold(ByteSpan body) {
  ByteReader r(body);
  FrameCold f;
  const bool whole = get_table(r, f.appearance, [](ByteReader& in) {
    AppearanceFeature a;
    a.u = in.get<float>();
    a.v = in.get<float>();
    a.disparity = in.get<float>();
    a.scale = in.get<float>();
    a.angle = in.get<float>();
    a.track = in.get<std::int16_t>();
    in.get_array(a.descriptor.data(), a.descriptor.size());
    return a;
  });
  if (!whole) return std::nullopt;
  f.picture = codec::get_blob(r);
  if (!r.at_end()) return std::nullopt;
  return f;
}

std::optional<std::vector<std::uint32_t>> decode_words(ByteSpan body) {
  ByteReader r(body);
  const auto count = r.get<std::uint32_t>();
  if (!r.fits(count, sizeof(std::uint32_t))) return std::nullopt;
  std::vector<std::uint32_t> words(count);
  r.get_array(words.data(), words.size());
  if (!r.at_end()) return std::nullopt;
  return words;
}

Result<SessionRecord> decode_session(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kVersion, kVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  SessionRecord record;
  Session& s = record.session = get_session(r);
  const bool whole = codec::get_table(r, record.skipped, [](ByteReader& in) {
    Skipped item;
    item.from = in.get<std::uint32_t>();
    item.to = in.get<std::uint32_t>();
    item.crc = in.get<std::uint32_t>();
    item.refused = codec::get_bool(in);
    item.reason = in.get<Reason>();
    return item;
  });
  if (sealed->kind != kSession || !whole || !r.at_end()) return Status(Reason::CORRUPT, "malformed session");
  for (const Skipped& item : record.skipped)
    (item.refused ? s.refused : s.given_up) += std::uint64_t{item.to} - item.from + 1;
  return record;
}

Result<MapState> decode_state(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kVersion, kVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  MapState s;
  if (!get_facts(r, s)) return Status(Reason::CORRUPT, "malformed state");
  std::vector<FrameId> pending, lookups;
  if (!codec::get_table(r, pending, codec::get_frame) || !codec::get_table(r, lookups, codec::get_frame) ||
      !r.at_end() || sealed->kind != kState)
    return Status(Reason::CORRUPT, "malformed state");
  for (const FrameId frame : pending) s.pending.insert(frame);
  s.lookups = {lookups.begin(), lookups.end()};
  return s;
}

}  // namespace relmap::storage::format1
