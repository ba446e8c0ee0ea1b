#include "storage/state_codec.h"

#include "storage/codec.h"
#include "storage/sealed.h"

namespace relmap {
namespace {

constexpr std::uint16_t kVersion = 1;
constexpr std::uint8_t kSession = 1, kState = 2;

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
  codec::put_table(w, s.settled, [](ByteWriter& out, const Settled& item) {
    out.put(item.from);
    out.put(item.to);
    out.put(item.crc);
    codec::put_bool(out, item.refused);
    out.put(item.reason);
  });
  return seal(kSession, kVersion, w.bytes());
}

Result<Session> decode_session(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
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
  const bool whole = codec::get_table(r, s.settled, [](ByteReader& in) {
    Settled item;
    item.from = in.get<std::uint32_t>();
    item.to = in.get<std::uint32_t>();
    item.crc = in.get<std::uint32_t>();
    item.refused = codec::get_bool(in);
    item.reason = in.get<Reason>();
    return item;
  });
  if (sealed->kind != kSession || !whole || !r.at_end()) return malformed("session");
  return s;
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
  const auto put_frame = [](ByteWriter& out, FrameId id) { codec::put(out, id); };
  codec::put_table(w, s.pending, put_frame);
  codec::put_table(w, s.lookups, put_frame);
  return seal(kState, kVersion, w.bytes());
}

Result<MapState> decode_state(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  MapState s;
  s.applied_sequence = r.get<std::uint64_t>();
  s.keyframes = r.get<std::uint64_t>();
  s.gaps = r.get<std::uint64_t>();
  s.closures_accepted = r.get<std::uint64_t>();
  s.closures_candidate = r.get<std::uint64_t>();
  s.closures_quarantined = r.get<std::uint64_t>();
  s.closures_removed = r.get<std::uint64_t>();
  s.numerical_failures = r.get<std::uint64_t>();
  s.vocabulary_crc = r.get<std::uint32_t>();
  if (r.get<std::uint16_t>() != s.refused.size()) return malformed("state");
  r.get_array(s.refused.data(), s.refused.size());
  std::vector<FrameId> pending, lookups;
  if (!codec::get_table(r, pending, codec::get_frame) || !codec::get_table(r, lookups, codec::get_frame) ||
      !r.at_end() || sealed->kind != kState)
    return malformed("state");
  s.pending = {pending.begin(), pending.end()};
  s.lookups = {lookups.begin(), lookups.end()};
  return s;
}

}  // namespace relmap
