// Any bytes as a record of the journal, as one of the records that describe the map beside its frames, and as the
// extensions of these: as they are, and sealed as what they may be. What decodes encodes to bytes that decode to the
// same again.
#include <memory>
#include <vector>

#include "proto/base/testing/fuzzing.h"
#include "proto/keyframe/extension_codec.h"
#include "storage/format/extension_tags.h"
#include "storage/format/sealed.h"
#include "storage/format/state_codec.h"
#include "storage/journal/journal_record.h"

namespace {

using namespace relmap;
using namespace relmap::storage;
using fuzzing::must;

template <typename Decoded>
void round_trip(ByteSpan bytes, Result<Decoded> (*decode)(ByteSpan), Bytes (*encode)(const Decoded&)) {
  const auto decoded = decode(bytes);
  if (!decoded.ok()) {
    must(fuzzing::is_one_of(decoded.reason(), {Reason::CORRUPT, Reason::TRUNCATED, Reason::UNKNOWN_FORMAT_VERSION}));
    return;
  }
  const Bytes once = encode(*decoded);
  const auto again = decode(once);
  must(again.ok() && encode(*again) == once);
}

// A field that is taken of extensions can be added to them again.
template <typename Field, typename Added>
void try_field(const Extensions& all, bool (*take)(Extensions&, Field&), void (*add)(Extensions&, Added),
               auto added_of) {
  Extensions rest = all;
  Field field{};
  if (!take(rest, field)) return;
  add(rest, added_of(field));
  Field again{};
  Extensions once = rest;
  must(take(rest, again));
  add(rest, added_of(again));
  must(rest == once);
}

void try_extensions(ByteSpan bytes) {
  ByteReader in(bytes);
  const auto all = read_extensions(in);
  if (!all.ok()) return;
  const auto itself = [](const auto& field) -> const auto& { return field; };
  const auto pointer = [](const std::shared_ptr<const WayAround>& around) { return around.get(); };
  try_field<Uniqueness, const Uniqueness&>(*all, tags::take_uniqueness, tags::add_uniqueness, itself);
  try_field<FrameRange, const FrameRange&>(*all, tags::take_carried, tags::add_carried, itself);
  try_field<std::shared_ptr<const WayAround>, const WayAround*>(*all, tags::take_way_around, tags::add_way_around,
                                                                pointer);
  try_field<std::vector<std::uint32_t>, const std::vector<std::uint32_t>&>(*all, tags::take_unseen, tags::add_unseen,
                                                                           itself);
  try_field<ClosureId, ClosureId>(*all, tags::take_unseen_place, tags::add_unseen_place, itself);
  try_field<MapIdentity, const MapIdentity&>(*all, tags::take_map_identity, tags::add_map_identity, itself);
  try_field<SessionState, SessionState>(*all, tags::take_before_frozen, tags::add_before_frozen, itself);
  try_field<std::uint64_t, std::uint64_t>(*all, tags::take_shown, tags::add_shown, itself);
  try_field<EditKey, const EditKey&>(*all, tags::take_edit_key, tags::add_edit_key, itself);
  try_field<std::string, const std::string&>(*all, tags::take_author, tags::add_author, itself);
  try_field<std::uint64_t, std::uint64_t>(*all, tags::take_digests_commit, tags::add_digests_commit, itself);
  try_field<DigestsMade, const DigestsMade&>(*all, tags::take_digests_made, tags::add_digests_made, itself);
}

void try_all(ByteSpan bytes) {
  if (const auto decoded = decode_record(bytes); decoded.ok()) {
    const Bytes once = encode_record(decoded->record, decoded->acknowledged_through);
    const auto again = decode_record(once);
    must(again.ok() && encode_record(again->record, again->acknowledged_through) == once);
    must((edit_key(decoded->record) != nullptr) == (edit_key(again->record) != nullptr));
  }
  round_trip<Session>(bytes, decode_session, encode_session);
  round_trip<Skipped>(bytes, decode_skipped, encode_skipped);
  round_trip<std::uint64_t>(bytes, decode_pending, [](const std::uint64_t& frames) { return encode_pending(frames); });
  round_trip<EditKey>(bytes, decode_edit, encode_edit);
  round_trip<MapState>(bytes, decode_state, encode_state);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan bytes(data, size);
  try_extensions(bytes);
  try_all(bytes);
  if (size == 0) return 0;
  // Bytes of chance do not pass the checksum. The first one is the kind of the record; each kind has some of these
  // versions.
  for (const std::uint16_t version : {1, 2, 3, 4}) try_all(seal(data[0], version, bytes.subspan(1)));
  return 0;
}
