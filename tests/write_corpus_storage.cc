// What fuzzers of the map's files on the disk start from: segments and records of the journal, parts of chunks.
#include <algorithm>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "proto/keyframe/extension_codec.h"
#include "storage/events/event_block.h"
#include "storage/format/chunk_codec.h"
#include "storage/format/digest_codec.h"
#include "storage/format/extension_tags.h"
#include "storage/format/frame_codec.h"
#include "storage/format/sealed.h"
#include "storage/format/state_codec.h"
#include "storage/journal/journal_record.h"
#include "storage/testing/random_frames.h"
#include "tests/write_corpus.h"

namespace relmap::testing {

using namespace storage;

// A record is a byte that says what is before it, the kind, the session, the frame, and for some kinds bytes.
void write_journal_segments(const std::string& root) {
  enum Mode { kSalted = 2, kUnsalted = 3 };
  enum Before { kNext = 0, kMissing = 3, kSegment = 4, kDamaged = 8, kTwoBehind = 32 };
  enum { kSession = 0, kKeyframe = 1, kGap = 3, kRefusal = 4, kIdle = 5, kNoKeyframe = 6 + 8 * 4, kNone = 7 + 8 * 4 };
  const Corpus corpus(root, "journal_segment_fuzz");
  for (const bool salted : {true, false}) {
    const int mode = salted ? kSalted : kUnsalted;
    const std::string name = salted ? "records_" : "unsalted_records_";
    corpus.add(name + "sound",
               {mode,  kNext,     kSession, 0, 0,        kNext,    kKeyframe, 0, 0,          kNext, kGap, 0, 1,
                kNext, kKeyframe, 0,        2, kSegment, kRefusal, 0,         3, kTwoBehind, kIdle, 0,    9});
    corpus.add(name + "hole", {mode, kNext, kSession, 0, 0, kNext, kKeyframe, 0, 0, kMissing, kKeyframe, 0, 5, kNext,
                               kKeyframe, 0, 6});
    corpus.add(name + "session_lost", {mode, kMissing, kKeyframe, 0, 3, kNext, kKeyframe, 0, 4});
    corpus.add(name + "session_lost_before_gap", {mode, kMissing, kGap, 0, 3, kNext, kKeyframe, 0, 7});
    corpus.add(name + "damaged",
               {mode, kNext, kSession, 0, 0, kDamaged, kKeyframe, 0, 0, kNext, kRefusal, 0, 4, kNext, kKeyframe, 0, 5});
    corpus.add(name + "two_sessions_two_holes",
               {mode,      kNext, kSession, 0,         0,     kNext, kSession, 1,         0,         kNext, kKeyframe,
                0,         0,     kMissing, kKeyframe, 1,     2,     kSegment, kKeyframe, 0,         4,     kMissing,
                kKeyframe, 1,     8,        kDamaged,  kIdle, 0,     0,        kNext,     kKeyframe, 0,     9});
    corpus.add(name + "no_keyframes",
               {mode, kNext, kSession, 0, 0, kNext, kNoKeyframe, 0,         0, 1, 2,     3,     4, kNext, kNone,
                0,    0,     1,        2, 3, 4,     kMissing,    kKeyframe, 0, 5, kNext, kIdle, 0, 0});
    corpus.add(name + "segment_begins_later", {mode, kNext, kSession, 0, 0, kMissing + kSegment, kKeyframe, 0, 1});
    corpus.add(name + "none", {mode});
  }
}

void write_journal_records(const std::string& root) {
  const Corpus corpus(root, "journal_record_fuzz");
  RandomFrames random(1);
  std::vector<std::size_t> of_kind(std::variant_size_v<JournalRecord>);
  for (int i = 0; i < 200; ++i) {
    JournalRecord record = random.record();
    std::size_t& number = of_kind[record.index()];
    if (number == 2) continue;
    const std::string name = "kind_" + std::to_string(record.index()) + "_" + std::to_string(number);
    if (EditKey* edit = edit_key(record); edit && number == 1) *edit = {"an edit", 4711};
    ++number;
    const Bytes bytes = encode_record(record, 7);
    if (bytes.size() > 4000) continue;
    corpus.add(name, {}, bytes);
    corpus.add(name + "_cut", {}, cut(bytes, 5));
  }
  // Version, kind, length before a sealed body, its checksum behind it. The fuzzer seals bodies as each version.
  const auto body = [](const Bytes& sealed) { return Bytes(sealed.begin() + 8, sealed.end() - 4); };
  enum { kSession = 1, kState, kSkipped, kPending, kEdit };
  Session session = random.session(3);
  session.unknown = {{99, {1, 2}}};
  session.before_frozen = SessionState::kEnded;
  corpus.add("session_of_all_fields", {}, encode_session(session));
  session.header.raw.reset();
  session.header.unknown = session.unknown = {};
  session.before_frozen = SessionState::kOpen;
  // Version 3 has no extensions, of which there are two lists, and version 2 no state either.
  constexpr std::size_t kNoExtensions = 2 * sizeof(std::uint16_t);
  const Bytes session_body = body(encode_session(session));
  corpus.add("session_version_3", {kSession}, cut(session_body, kNoExtensions));
  corpus.add("session_version_2", {kSession}, cut(session_body, kNoExtensions + 1));
  MapState state;
  state.applied_sequence = 17;
  state.lookups = {{1, 2}, {3, 4}};
  state.idle_records = 5;
  const Bytes state_body = body(encode_state(state));
  corpus.add("state_version_3", {kState}, cut(state_body, sizeof(std::uint16_t)));
  corpus.add("state_version_2", {kState}, cut(state_body, sizeof(std::uint16_t) + sizeof(std::uint32_t)));
  state.identity = {Uuid{{1, 2}}, 9};
  corpus.add("state_of_all_fields", {}, encode_state(state));
  corpus.add("skipped", {}, encode_skipped(random.skipped()));
  corpus.add("skipped_body", {kSkipped}, body(encode_skipped(random.skipped())));
  corpus.add("pending", {}, encode_pending(0x8001));
  corpus.add("pending_none", {kPending}, body(encode_pending(0)));
  corpus.add("edit", {}, encode_edit({"an edit", 1}));
  corpus.add("edit_without_name", {kEdit}, body(encode_edit({"", 1})));
  corpus.add("unknown_kind", {99}, Bytes(20, 0));

  Extensions all;
  Uniqueness uniqueness;
  uniqueness.known = true;
  uniqueness.runner_up = {1, 2};
  uniqueness.alike = 3;
  tags::add_uniqueness(all, uniqueness);
  tags::add_carried(all, {1, 5, 9});
  const WayAround around{{1, 4}, SE3(), 0.01 * Matrix6::Identity()};
  tags::add_way_around(all, &around);
  tags::add_unseen(all, {4, 5, 70});
  tags::add_unseen_place(all, {{1, 9}, 1});
  tags::add_map_identity(all, {Uuid{{1, 2}}, 9});
  tags::add_before_frozen(all, SessionState::kEnded);
  tags::add_shown(all, 17);
  tags::add_digests_commit(all, 12);
  tags::add_digests_made(all, {12, {1, 3}, 200});
  tags::add_edit_key(all, {"an edit", 1});
  tags::add_submission(all, 1'700'000'000'000'000, "ann");
  std::sort(all.begin(), all.end(), [](const Extension& a, const Extension& b) { return a.tag < b.tag; });
  const auto extensions = [](const Extensions& list) {
    ByteWriter w;
    put_extensions(w, list);
    return w.take();
  };
  corpus.add("extensions", {}, extensions(all));
  for (const Extension& one : all) {
    const std::string name = "extension_" + std::to_string(one.tag);
    corpus.add(name, {}, extensions({one}));
    if (one.bytes.empty()) continue;
    corpus.add(name + "_cut", {}, extensions({{one.tag, cut(one.bytes, 1)}}));
    corpus.add(name + "_empty", {}, extensions({{one.tag, {}}}));
  }
}

// Frames for which the fuzzer writes containers: how far its slot is behind the one before, length, body.
namespace {

void write_digests(const std::string& root) {
  constexpr ChunkId kChunk{3, 9};
  const Corpus corpus(root, "digest_fuzz");
  RandomFrames random(1);
  DigestWriter writer(kChunk, 1'700'000'000'000'000);
  for (std::uint32_t slot = 0; slot < 6; ++slot) {
    const FrameId id = frame_in(kChunk, slot);
    FrameHot hot = random.hot(id);
    if (slot > 0) hot.edges.insert(hot.edges.begin(), random.edge(id, 0));
    const FrameDigest digest = digest_of(id, hot);
    writer.add(digest);
    DigestWriter one(kChunk, 0);
    one.add(digest);
    const Bytes record = one.finish();
    const ByteSpan entry = unpack_digests(record, kChunk).or_throw().entries[slot];
    corpus.add("entry_" + std::to_string(slot), {}, Bytes(entry.begin(), entry.end()));
  }
  const Bytes record = writer.finish();
  constexpr std::size_t kBefore = 8, kBehind = 4;  // the seal
  corpus.add("record", {}, record);
  corpus.add("body", {}, Bytes(record.begin() + kBefore, record.end() - kBehind));
  corpus.add("body_cut", {}, Bytes(record.begin() + kBefore, record.end() - kBehind - 3));
  Bytes other(record.begin() + kBefore, record.end() - kBehind);
  other[0] ^= 1;
  corpus.add("body_of_another_chunk", {}, other);
  corpus.add("no_frames", {}, DigestWriter(kChunk, 0).finish());
}

}  // namespace

void write_chunks(const std::string& root) {
  write_digests(root);
  constexpr ChunkId kChunk{3, 9};
  constexpr std::size_t kBody = 3000;
  const Corpus corpus(root, "chunk_fuzz");
  RandomFrames random(1);
  PartWriter hot(Part::kHot, kChunk, 1), warm(Part::kWarm, kChunk, 1);
  ByteWriter frames;
  const auto add_frame = [&](std::uint8_t step, ByteSpan body) {
    frames.put(step);
    frames.put(static_cast<std::uint16_t>(body.size()));
    frames.put_bytes(body);
  };
  for (std::uint32_t slot = 0; slot < 6; ++slot) {
    const FrameId id = frame_in(kChunk, slot);
    ByteWriter h, w;
    while (h.size() == 0 || h.size() > kBody) {
      h = {};
      encode_hot(h, id, random.hot(id));
    }
    while (w.size() == 0 || w.size() > kBody) {
      w = {};
      encode_warm(w, id, random.warm());
    }
    hot.add(slot, h.bytes());
    warm.add(slot, w.bytes());
    add_frame(0, slot % 2 == 0 ? h.bytes() : w.bytes());
    corpus.add("body_hot_" + std::to_string(slot), {}, h.bytes());
    corpus.add("body_warm_" + std::to_string(slot), {}, w.bytes());
  }
  add_frame(7, Bytes{1, 2, 3});
  corpus.add("frames", {}, frames.bytes());
  corpus.add("container_hot", {}, hot.finish());
  corpus.add("container_warm", {}, warm.finish());
  const Bytes sound = hot.finish();
  const auto changed = [&](std::size_t at, int to) {
    Bytes bytes = sound;
    bytes[at] = static_cast<std::uint8_t>(to);
    return bytes;
  };
  corpus.add("container_damaged", {}, changed(sound.size() - 1, sound.back() ^ 1));
  corpus.add("container_cut", {}, cut(sound, 9));
  corpus.add("container_of_another_version", {}, changed(4, 9));
  corpus.add("container_of_another_part", {}, changed(6, 4));
  corpus.add("container_of_another_chunk", {}, changed(8, 7));
  corpus.add("container_slots_backwards", {}, changed(32 + 12, 0));
  corpus.add("container_body_short", {}, changed(32 + 4, 1));
  ByteWriter cold;
  FrameCold picture = random.cold();
  picture.picture.resize(20);
  encode_cold(cold, picture);
  corpus.add("body_cold", {}, cold.bytes());
}

// Bodies of blocks, which the fuzzer seals, and whole blocks.
void write_event_blocks(const std::string& root) {
  const Corpus corpus(root, "event_block_fuzz");
  RandomFrames random(1);
  EventBlock all;
  std::vector<std::size_t> of_kind(std::variant_size_v<EventContent>);
  EventPosition at;
  const auto add = [&](const std::string& name, const EventBlock& block) {
    EventBlockHeader header{1'700'000'000'000'000, {}, {}, 0};
    const Bytes bytes = encode_event_block(header, block);
    corpus.add(name, {}, bytes);
    corpus.add(name + "_body", {}, unseal(bytes, 1, 1).or_throw().body);
  };
  for (int i = 0; i < 100; ++i) {
    at = i % 3 == 0 ? EventPosition{at.sequence + 1, 0} : EventPosition{at.sequence, at.ordinal + 1};
    const Event event = random.event(at);
    const std::size_t number = of_kind[event.content.index()]++;
    if (number > 1) continue;
    all.add(event);
    EventBlock one;
    one.add(event);
    add("kind_" + std::to_string(event.content.index()) + "_" + std::to_string(number), one);
  }
  add("all_kinds", all);
  const Bytes head = encode_event_head({{3, 0}, {90, kMovedOrdinal}, 4711});
  corpus.add("head", {}, head);
  corpus.add("head_body", {}, unseal(head, 1, 1).or_throw().body);
  corpus.add("head_cut", {}, cut(head, 3));
}

}  // namespace relmap::testing
