#include "storage/format/state_codec.h"

#include "proto/keyframe/extension_codec.h"
#include "storage/format/codec.h"
#include "storage/format/extension_tags.h"
#include "storage/format/sealed.h"

namespace relmap::storage {
namespace {

constexpr std::uint16_t kStateVersion = 4;  // of a session, and of the map's state
// The version of map format 2 where a session is open, or where idle work did not come last. Otherwise that format
// wrote version 3, with the session's state, or the number of records of idle work, behind all else. Skipped sequences
// and pending frames still have this version.
constexpr std::uint16_t kFormat2 = 2;
constexpr std::uint8_t kSessionKind = 1, kStateKind = 2, kSkippedKind = 3, kPendingKind = 4, kEditKind = 5;

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
  w.put(s.state);
  put_extensions(w, header_extensions(s.header));
  Extensions extensions = s.unknown;
  tags::add_before_frozen(extensions, s.before_frozen);
  tags::add_author(extensions, s.deleted_by);
  put_extensions(w, extensions);
  return seal(kSessionKind, kStateVersion, w.bytes());
}

Result<Session> decode_session(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kFormat2, kStateVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  Session s = get_session(r);
  s.refused = r.get<std::uint64_t>();
  s.given_up = r.get<std::uint64_t>();
  if (sealed->version > kFormat2) s.state = r.get<SessionState>();
  if (sealed->version == kStateVersion) {
    if (!set_header_extensions(s.header, get_extensions(r))) return malformed("session");
    s.unknown = get_extensions(r);
    if (!tags::take_before_frozen(s.unknown, s.before_frozen) || !tags::take_author(s.unknown, s.deleted_by))
      return malformed("session");
  }
  if (s.state > SessionState::kDeleting) return malformed("session");
  if (sealed->kind != kSessionKind || !r.at_end()) return malformed("session");
  return s;
}

Bytes encode_skipped(const Skipped& skipped) {
  ByteWriter w;
  w.put(skipped.from);
  w.put(skipped.to);
  w.put(skipped.crc);
  codec::put_bool(w, skipped.refused);
  w.put(skipped.reason);
  return seal(kSkippedKind, kFormat2, w.bytes());
}

Result<Skipped> decode_skipped(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kFormat2, kFormat2);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  Skipped skipped;
  skipped.from = r.get<std::uint32_t>();
  skipped.to = r.get<std::uint32_t>();
  skipped.crc = r.get<std::uint32_t>();
  skipped.refused = codec::get_bool(r);
  skipped.reason = r.get<Reason>();
  if (sealed->kind != kSkippedKind || !r.at_end()) return malformed("record of skipped sequences");
  return skipped;
}

Bytes encode_pending(std::uint64_t frames) {
  ByteWriter w;
  w.put(frames);
  return seal(kPendingKind, kFormat2, w.bytes());
}

Result<std::uint64_t> decode_pending(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kFormat2, kFormat2);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  const auto frames = r.get<std::uint64_t>();
  if (sealed->kind != kPendingKind || !r.at_end() || frames == 0) return malformed("record of frames that wait");
  return frames;
}

Bytes encode_edit(const EditKey& edit) {
  ByteWriter w;
  w.put(edit.content);
  w.put_string(edit.key);
  return seal(kEditKind, kStateVersion, w.bytes());
}

Result<EditKey> decode_edit(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kStateVersion, kStateVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  EditKey edit;
  edit.content = r.get<std::uint64_t>();
  edit.key = r.get_string();
  if (sealed->kind != kEditKind || !r.at_end() || edit.key.empty() || edit.key.size() > kMaxEditKeyBytes)
    return malformed("record of an edit");
  return edit;
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
  w.put(s.idle_records);
  Extensions extensions = s.unknown;
  tags::add_map_identity(extensions, s.identity);
  tags::add_digests_commit(extensions, s.digests_commit);
  tags::add_digests_made(extensions, s.digests_made);
  put_extensions(w, extensions);
  return seal(kStateKind, kStateVersion, w.bytes());
}

Result<MapState> decode_state(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kFormat2, kStateVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  MapState s;
  if (!get_facts(r, s)) return malformed("state");
  std::vector<FrameId> lookups;
  if (!codec::get_table(r, lookups, codec::get_frame)) return malformed("state");
  if (sealed->version > kFormat2) s.idle_records = r.get<std::uint32_t>();
  if (sealed->version == kStateVersion) {
    s.unknown = get_extensions(r);
    if (!tags::take_map_identity(s.unknown, s.identity) || !tags::take_digests_commit(s.unknown, s.digests_commit) ||
        !tags::take_digests_made(s.unknown, s.digests_made))
      return malformed("state");
  }
  if (!r.at_end() || sealed->kind != kStateKind) return malformed("state");
  s.lookups = {lookups.begin(), lookups.end()};
  return s;
}

}  // namespace relmap::storage
