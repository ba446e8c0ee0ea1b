#include "storage/state_codec.h"

#include "storage/codec.h"
#include "storage/sealed.h"

namespace relmap {
namespace {

constexpr std::uint16_t kVersion = 2;
constexpr std::uint16_t kSessionInState = 3;  // of a session that is not open: its state follows
constexpr std::uint16_t kStateInIdle = 3;     // idle work came last: how often follows
constexpr std::uint8_t kSession = 1, kState = 2, kSettled = 3, kPending = 4;

Status malformed(const char* what) { return Status(Reason::CORRUPT, std::string("malformed ") + what); }

}  // namespace

void put_header(ByteWriter& w, const SessionHeader& h) {
  w.put_array(h.uuid.bytes.data(), h.uuid.bytes.size());
  w.put_string(h.robot);
  w.put_string(h.name);
  w.put(h.camera.f);
  w.put(h.camera.cx);
  w.put(h.camera.cy);
  w.put(h.camera.baseline);
  w.put(std::int32_t{h.camera.width});
  w.put(std::int32_t{h.camera.height});
  codec::put_bool(w, h.oneway);
}

SessionHeader get_header(ByteReader& r) {
  SessionHeader h;
  r.get_array(h.uuid.bytes.data(), h.uuid.bytes.size());
  h.robot = r.get_string();
  h.name = r.get_string();
  h.camera.f = r.get<double>();
  h.camera.cx = r.get<double>();
  h.camera.cy = r.get<double>();
  h.camera.baseline = r.get<double>();
  h.camera.width = r.get<std::int32_t>();
  h.camera.height = r.get<std::int32_t>();
  h.oneway = codec::get_bool(r);
  return h;
}

Session get_session(ByteReader& r) {
  Session s;
  s.number = r.get<SessionNumber>();
  s.header = get_header(r);
  s.display_name = r.get_string();
  s.first = r.get<std::uint32_t>();
  s.last = r.get<std::uint32_t>();
  s.frames = r.get<std::uint32_t>();
  s.next_sequence = r.get<std::uint32_t>();
  s.first_time_us = r.get<std::int64_t>();
  s.last_time_us = r.get<std::int64_t>();
  return s;
}

bool get_facts(ByteReader& r, MapFacts& s) {
  s.applied_sequence = r.get<std::uint64_t>();
  s.keyframes = r.get<std::uint64_t>();
  s.gaps = r.get<std::uint64_t>();
  s.closures_accepted = r.get<std::uint64_t>();
  s.closures_candidate = r.get<std::uint64_t>();
  s.closures_quarantined = r.get<std::uint64_t>();
  s.closures_removed = r.get<std::uint64_t>();
  s.numerical_failures = r.get<std::uint64_t>();
  s.vocabulary_crc = r.get<std::uint32_t>();
  if (r.get<std::uint16_t>() != s.refused.size()) return false;
  r.get_array(s.refused.data(), s.refused.size());
  return true;
}

Bytes encode_session(const Session& s) {
  ByteWriter w;
  w.put(s.number);
  put_header(w, s.header);
  w.put_string(s.display_name);
  w.put(s.first);
  w.put(s.last);
  w.put(s.frames);
  w.put(s.next_sequence);
  w.put(s.first_time_us);
  w.put(s.last_time_us);
  w.put(s.refused);
  w.put(s.given_up);
  if (s.state == SessionState::kOpen) return seal(kSession, kVersion, w.bytes());
  w.put(s.state);
  return seal(kSession, kSessionInState, w.bytes());
}

Result<Session> decode_session(ByteSpan bytes) {
  auto sealed = unseal(bytes, kVersion);
  const bool in_state = sealed.reason() == Reason::UNKNOWN_FORMAT_VERSION;
  if (in_state) sealed = unseal(bytes, kSessionInState);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  Session s = get_session(r);
  s.refused = r.get<std::uint64_t>();
  s.given_up = r.get<std::uint64_t>();
  if (in_state) s.state = r.get<SessionState>();
  if (s.state > SessionState::kDeleting) return malformed("session");
  if (sealed->kind != kSession || !r.at_end()) return malformed("session");
  return s;
}

Bytes encode_settled(const Settled& settled) {
  ByteWriter w;
  w.put(settled.from);
  w.put(settled.to);
  w.put(settled.crc);
  codec::put_bool(w, settled.refused);
  w.put(settled.reason);
  return seal(kSettled, kVersion, w.bytes());
}

Result<Settled> decode_settled(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  Settled settled;
  settled.from = r.get<std::uint32_t>();
  settled.to = r.get<std::uint32_t>();
  settled.crc = r.get<std::uint32_t>();
  settled.refused = codec::get_bool(r);
  settled.reason = r.get<Reason>();
  if (sealed->kind != kSettled || !r.at_end()) return malformed("record of what is settled");
  return settled;
}

Bytes encode_pending(std::uint64_t frames) {
  ByteWriter w;
  w.put(frames);
  return seal(kPending, kVersion, w.bytes());
}

Result<std::uint64_t> decode_pending(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  const auto frames = r.get<std::uint64_t>();
  if (sealed->kind != kPending || !r.at_end() || frames == 0) return malformed("record of frames that wait");
  return frames;
}

Bytes encode_state(const MapState& s) {
  ByteWriter w;
  w.reserve(2048);
  w.put(s.applied_sequence);
  w.put(s.keyframes);
  w.put(s.gaps);
  w.put(s.closures_accepted);
  w.put(s.closures_candidate);
  w.put(s.closures_quarantined);
  w.put(s.closures_removed);
  w.put(s.numerical_failures);
  w.put(s.vocabulary_crc);
  w.put(static_cast<std::uint16_t>(s.refused.size()));
  for (const std::uint64_t count : s.refused) w.put(count);
  codec::put_table(w, s.lookups, [](ByteWriter& out, FrameId id) { codec::put(out, id); });
  if (s.idle_records == 0) return seal(kState, kVersion, w.bytes());
  w.put(s.idle_records);
  return seal(kState, kStateInIdle, w.bytes());
}

Result<MapState> decode_state(ByteSpan bytes) {
  auto sealed = unseal(bytes, kVersion);
  const bool in_idle = sealed.reason() == Reason::UNKNOWN_FORMAT_VERSION;
  if (in_idle) sealed = unseal(bytes, kStateInIdle);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  MapState s;
  if (!get_facts(r, s)) return malformed("state");
  std::vector<FrameId> lookups;
  if (!codec::get_table(r, lookups, codec::get_frame)) return malformed("state");
  if (in_idle) s.idle_records = r.get<std::uint32_t>();
  if (!r.at_end() || sealed->kind != kState) return malformed("state");
  s.lookups = {lookups.begin(), lookups.end()};
  return s;
}

}  // namespace relmap
