#include "storage/journal/journal_record.h"

#include "proto/keyframe/extension_codec.h"
#include "storage/format/codec.h"
#include "storage/format/extension_tags.h"
#include "storage/format/sealed.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {
namespace {

constexpr std::uint16_t kRecordVersion = 1;
constexpr std::uint16_t kExtended = 2;  // of records that end in extensions

// Numbers on disk; they never change.
enum Kind : std::uint8_t {
  kSession = 1,
  kKeyframe = 2,
  kGap = 3,
  kRefusal = 4,
  kClosureProposal = 5,
  kBinding = 6,
  kSetEdgeState = 7,
  kSetLabel = 8,
  kIdleWork = 9,
  kSetSessionState = 10,
  kRemoveChunk = 11,
  kUnseen = 12,
};

constexpr std::uint8_t kAlignedBinding = 0x80;  // beside the level, which is at most 31

void put_bindings(ByteWriter& w, const std::vector<ProposedBinding>& bindings) {
  codec::put_table(w, bindings, [](ByteWriter& out, const ProposedBinding& b) {
    codec::put(out, b.landmark);
    out.put(b.track);
    out.put(b.u_left);
    out.put(b.v);
    out.put(b.u_right);
    out.put(static_cast<std::uint8_t>(b.level | (b.aligned ? kAlignedBinding : 0)));
  });
}

bool get_bindings(ByteReader& r, std::vector<ProposedBinding>& bindings) {
  return codec::get_table(r, bindings, [](ByteReader& in) {
    ProposedBinding b;
    b.landmark = codec::get_landmark(in);
    b.track = in.get<std::int32_t>();
    b.u_left = in.get<float>();
    b.v = in.get<float>();
    b.u_right = in.get<float>();
    const auto level = in.get<std::uint8_t>();
    b.level = level & ~kAlignedBinding;
    b.aligned = (level & kAlignedBinding) != 0;
    return b;
  });
}

Kind put(ByteWriter& w, const SessionRecord& x) {
  w.put(x.number);
  w.put_string(x.display_name);
  put_header(w, x.header);
  return kSession;
}
bool get(ByteReader& r, SessionRecord& x) {
  x.number = r.get<SessionNumber>();
  x.display_name = r.get_string();
  x.header = get_header(r);
  return true;
}

Kind put(ByteWriter& w, const KeyframeRecord& x) {
  w.put(x.session);
  w.put(x.crc);
  codec::put_blob(w, x.payload);
  return kKeyframe;
}
bool get(ByteReader& r, KeyframeRecord& x) {
  x.session = r.get<SessionNumber>();
  x.crc = r.get<std::uint32_t>();
  x.payload = codec::get_blob(r);
  return true;
}

Kind put(ByteWriter& w, const GapRecord& x) {
  w.put(x.session);
  w.put(x.from);
  w.put(x.to);
  w.put(x.reason);
  return kGap;
}
bool get(ByteReader& r, GapRecord& x) {
  x.session = r.get<SessionNumber>();
  x.from = r.get<std::uint32_t>();
  x.to = r.get<std::uint32_t>();
  x.reason = r.get<Reason>();
  return x.from <= x.to && is_reason(static_cast<std::uint16_t>(x.reason));
}

Kind put(ByteWriter& w, const RefusalRecord& x) {
  w.put(x.session);
  w.put(x.sequence);
  w.put(x.crc);
  w.put(x.reason);
  return kRefusal;
}
bool get(ByteReader& r, RefusalRecord& x) {
  x.session = r.get<SessionNumber>();
  x.sequence = r.get<std::uint32_t>();
  x.crc = r.get<std::uint32_t>();
  x.reason = r.get<Reason>();
  return is_reason(static_cast<std::uint16_t>(x.reason));
}

Kind put(ByteWriter& w, const ClosureProposalRecord& x) {
  codec::put(w, x.query);
  codec::put(w, x.match);
  codec::put(w, x.T_match_query);
  codec::put(w, x.covariance);
  w.put(x.verification);
  w.put(x.inliers);
  w.put(x.probability);
  w.put(x.spread);
  put_bindings(w, x.bindings);
  return kClosureProposal;
}
bool get(ByteReader& r, ClosureProposalRecord& x) {
  x.query = codec::get_frame(r);
  x.match = codec::get_frame(r);
  x.T_match_query = codec::get_se3(r);
  x.covariance = codec::get_matrix6(r);
  x.verification = r.get<Verification>();
  x.inliers = r.get<std::uint16_t>();
  x.probability = r.get<float>();
  x.spread = r.get<float>();
  return x.verification <= Verification::kCompounded && get_bindings(r, x.bindings);
}

Kind put(ByteWriter& w, const BindingRecord& x) {
  codec::put(w, x.frame);
  codec::put(w, x.closure);
  put_bindings(w, x.bindings);
  return kBinding;
}
bool get(ByteReader& r, BindingRecord& x) {
  x.frame = codec::get_frame(r);
  x.closure = codec::get_edge(r);
  return get_bindings(r, x.bindings);
}

Kind put(ByteWriter& w, const UnseenRecord& x) {
  codec::put(w, x.frame);
  codec::put(w, x.closure);
  return kUnseen;
}
bool get(ByteReader& r, UnseenRecord& x) {
  x.frame = codec::get_frame(r);
  x.closure = codec::get_edge(r);
  return true;
}

Kind put(ByteWriter& w, const SetEdgeStateRecord& x) {
  codec::put(w, x.edge);
  w.put(x.state);
  codec::put_long_string(w, x.note);
  return kSetEdgeState;
}
bool get(ByteReader& r, SetEdgeStateRecord& x) {
  x.edge = codec::get_edge(r);
  x.state = r.get<EdgeState>();
  x.note = codec::get_long_string(r);
  return x.state >= EdgeState::kCandidate && x.state <= EdgeState::kRemoved;
}

Kind put(ByteWriter& w, const SetLabelRecord& x) {
  codec::put(w, x.frame);
  codec::put_bool(w, x.present);
  codec::put_long_string(w, x.label);
  return kSetLabel;
}
bool get(ByteReader& r, SetLabelRecord& x) {
  x.frame = codec::get_frame(r);
  x.present = codec::get_bool(r);
  x.label = codec::get_long_string(r);
  return true;
}

Kind put(ByteWriter& w, const IdleWorkRecord& x) {
  w.put(x.budget);
  return kIdleWork;
}
bool get(ByteReader& r, IdleWorkRecord& x) {
  x.budget = r.get<std::uint64_t>();
  return true;
}

Kind put(ByteWriter& w, const SetSessionStateRecord& x) {
  w.put(x.session);
  w.put(x.state);
  return kSetSessionState;
}
bool get(ByteReader& r, SetSessionStateRecord& x) {
  x.session = r.get<SessionNumber>();
  x.state = r.get<SessionState>();
  return x.state <= SessionState::kDeleting;
}

Kind put(ByteWriter& w, const RemoveChunkRecord& x) {
  w.put(x.session);
  w.put(x.chunk);
  return kRemoveChunk;
}
bool get(ByteReader& r, RemoveChunkRecord& x) {
  x.session = r.get<SessionNumber>();
  x.chunk = r.get<std::uint32_t>();
  return true;
}

// Record types without extensions are never written in the version that has them.
template <typename Record>
Extensions extensions_of(const Record&) {
  return {};
}
template <typename Record>
bool take_extensions(Record&, Extensions) {
  return false;
}

void add_submission(Extensions& all, const Submission& x) { tags::add_submission(all, x.time_us, x.author); }
bool take_submission(Extensions& all, Submission& x) { return tags::take_submission(all, x.time_us, x.author); }

Extensions extensions_of(const SessionRecord& x) {
  Extensions all = header_extensions(x.header);
  (void)take_extension(all, tags::kWallTime);  // a robot may have written anything there
  (void)take_extension(all, tags::kAuthor);
  add_submission(all, x.submitted);
  return all;
}
bool take_extensions(SessionRecord& x, Extensions all) {
  return take_submission(all, x.submitted) && set_header_extensions(x.header, std::move(all));
}

Extensions extensions_of(const ClosureProposalRecord& x) {
  Extensions all = x.unknown;
  tags::add_uniqueness(all, x.uniqueness);
  tags::add_way_around(all, x.around.get());
  tags::add_unseen_place(all, x.unseen);
  tags::add_edit_key(all, x.edit);
  add_submission(all, x.submitted);
  return all;
}
bool take_extensions(ClosureProposalRecord& x, Extensions all) {
  x.unknown = std::move(all);
  return tags::take_uniqueness(x.unknown, x.uniqueness) && tags::take_way_around(x.unknown, x.around) &&
         tags::take_unseen_place(x.unknown, x.unseen) && tags::take_edit_key(x.unknown, x.edit) &&
         take_submission(x.unknown, x.submitted);
}

Extensions extensions_of(const SetEdgeStateRecord& x) {
  Extensions all = x.unknown;
  if (x.decided) add_extension(all, tags::kDecided, {});
  if (x.alone) add_extension(all, tags::kAlone, {});
  tags::add_shown(all, x.shown);
  tags::add_edit_key(all, x.edit);
  add_submission(all, x.submitted);
  return all;
}
bool take_extensions(SetEdgeStateRecord& x, Extensions all) {
  x.unknown = std::move(all);
  const auto take_flag = [&](std::uint32_t tag, bool& flag) {
    const auto there = take_extension(x.unknown, tag);
    flag = there.has_value();
    return !there || there->empty();
  };
  return take_flag(tags::kDecided, x.decided) && take_flag(tags::kAlone, x.alone) &&
         tags::take_shown(x.unknown, x.shown) && tags::take_edit_key(x.unknown, x.edit) &&
         take_submission(x.unknown, x.submitted);
}

Extensions extensions_of(const SetLabelRecord& x) {
  Extensions all = x.unknown;
  tags::add_edit_key(all, x.edit);
  add_submission(all, x.submitted);
  return all;
}
bool take_extensions(SetLabelRecord& x, Extensions all) {
  x.unknown = std::move(all);
  return tags::take_edit_key(x.unknown, x.edit) && take_submission(x.unknown, x.submitted);
}

Extensions extensions_of(const SetSessionStateRecord& x) {
  Extensions all = x.unknown;
  tags::add_edit_key(all, x.edit);
  add_submission(all, x.submitted);
  return all;
}
bool take_extensions(SetSessionStateRecord& x, Extensions all) {
  x.unknown = std::move(all);
  return tags::take_edit_key(x.unknown, x.edit) && take_submission(x.unknown, x.submitted);
}

Extensions extensions_of(const RemoveChunkRecord& x) {
  Extensions all = x.unknown;
  add_submission(all, x.submitted);
  return all;
}
bool take_extensions(RemoveChunkRecord& x, Extensions all) {
  x.unknown = std::move(all);
  return take_submission(x.unknown, x.submitted);
}

Extensions extensions_of(const UnseenRecord& x) {
  Extensions all = x.unknown;
  add_submission(all, x.submitted);
  return all;
}
bool take_extensions(UnseenRecord& x, Extensions all) {
  x.unknown = std::move(all);
  return take_submission(x.unknown, x.submitted);
}

template <typename Record>
Result<DecodedRecord> decode_as(ByteReader& r, std::uint16_t version, std::uint64_t acknowledged_through) {
  Record record;
  if (!get(r, record) || (version == kExtended && !take_extensions(record, get_extensions(r))) || !r.at_end())
    return Status(Reason::CORRUPT, "malformed journal record");
  return DecodedRecord{std::move(record), acknowledged_through};
}

}  // namespace

Bytes encode_record(const JournalRecord& record, std::uint64_t acknowledged_through) {
  ByteWriter w;
  w.put(acknowledged_through);
  const Kind kind = std::visit([&](const auto& x) { return put(w, x); }, record);
  const Extensions extensions = std::visit([](const auto& x) { return extensions_of(x); }, record);
  if (extensions.empty()) return seal(kind, kRecordVersion, w.bytes());
  put_extensions(w, extensions);
  return seal(kind, kExtended, w.bytes());
}

Result<DecodedRecord> decode_record(ByteSpan bytes) {
  const auto sealed = unseal(bytes, kRecordVersion, kExtended);
  if (!sealed.ok()) return sealed.status();
  ByteReader r(sealed->body);
  const auto acknowledged = r.get<std::uint64_t>();
  switch (sealed->kind) {
    case kSession:
      return decode_as<SessionRecord>(r, sealed->version, acknowledged);
    case kKeyframe:
      return decode_as<KeyframeRecord>(r, sealed->version, acknowledged);
    case kGap:
      return decode_as<GapRecord>(r, sealed->version, acknowledged);
    case kRefusal:
      return decode_as<RefusalRecord>(r, sealed->version, acknowledged);
    case kClosureProposal:
      return decode_as<ClosureProposalRecord>(r, sealed->version, acknowledged);
    case kBinding:
      return decode_as<BindingRecord>(r, sealed->version, acknowledged);
    case kSetEdgeState:
      return decode_as<SetEdgeStateRecord>(r, sealed->version, acknowledged);
    case kSetLabel:
      return decode_as<SetLabelRecord>(r, sealed->version, acknowledged);
    case kIdleWork:
      return decode_as<IdleWorkRecord>(r, sealed->version, acknowledged);
    case kSetSessionState:
      return decode_as<SetSessionStateRecord>(r, sealed->version, acknowledged);
    case kRemoveChunk:
      return decode_as<RemoveChunkRecord>(r, sealed->version, acknowledged);
    case kUnseen:
      return decode_as<UnseenRecord>(r, sealed->version, acknowledged);
    default:
      return Status(Reason::UNKNOWN_FORMAT_VERSION, "journal record of kind " + std::to_string(sealed->kind));
  }
}

}  // namespace relmap::storage
