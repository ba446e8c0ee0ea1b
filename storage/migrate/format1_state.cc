#include "storage/migrate/format1_state.h"

#include "storage/format/codec.h"
#include "storage/format/sealed.h"
#include "storage/format/state_codec.h"

namespace relmap::storage::format1 {
namespace {

constexpr std::uint16_t kVersion = 1;
constexpr std::uint8_t kSession = 1, kState = 2;

}  // namespace

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
