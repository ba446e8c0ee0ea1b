#include "storage/migrate/format1_state.h"

#include "storage/codec.h"
#include "storage/sealed.h"
#include "storage/state_codec.h"

namespace relmap::format1 {
namespace {

constexpr std::uint16_t kVersion = 1;
constexpr std::uint8_t kSession = 1, kState = 2;

}  // namespace

Result<SessionRecord> decode_session(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kVersion);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  SessionRecord record;
  Session& s = record.session;
  s.number = r.get<SessionNumber>();
  s.header = get_header(r);
  s.display_name = r.get_string();
  s.first = r.get<std::uint32_t>();
  s.last = r.get<std::uint32_t>();
  s.frames = r.get<std::uint32_t>();
  s.next_sequence = r.get<std::uint32_t>();
  s.first_time_us = r.get<std::int64_t>();
  s.last_time_us = r.get<std::int64_t>();
  const bool whole = codec::get_table(r, record.settled, [](ByteReader& in) {
    Settled item;
    item.from = in.get<std::uint32_t>();
    item.to = in.get<std::uint32_t>();
    item.crc = in.get<std::uint32_t>();
    item.refused = codec::get_bool(in);
    item.reason = in.get<Reason>();
    return item;
  });
  if (sealed->kind != kSession || !whole || !r.at_end()) return Status(Reason::CORRUPT, "malformed session");
  for (const Settled& item : record.settled)
    (item.refused ? s.refused : s.given_up) += std::uint64_t{item.to} - item.from + 1;
  return record;
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
  if (r.get<std::uint16_t>() != s.refused.size()) return Status(Reason::CORRUPT, "malformed state");
  r.get_array(s.refused.data(), s.refused.size());
  std::vector<FrameId> pending, lookups;
  if (!codec::get_table(r, pending, codec::get_frame) || !codec::get_table(r, lookups, codec::get_frame) ||
      !r.at_end() || sealed->kind != kState)
    return Status(Reason::CORRUPT, "malformed state");
  for (const FrameId frame : pending) s.pending.insert(frame);
  s.lookups = {lookups.begin(), lookups.end()};
  return s;
}

}  // namespace relmap::format1
