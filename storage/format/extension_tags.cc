#include "storage/format/extension_tags.h"

#include <algorithm>
#include <string>
#include <utility>

#include "proto/keyframe/extension_codec.h"
#include "storage/format/codec.h"
#include "storage/format/varint.h"

namespace relmap::storage::tags {

void add_uniqueness(Extensions& extensions, const Uniqueness& u) {
  if (!u.known) return;
  ByteWriter w;
  w.reserve(24);
  codec::put(w, u.runner_up);
  w.put(u.runner_up_inliers);
  w.put(u.runner_up_probability);
  w.put(u.alike);
  w.put(u.differs);
  w.put(u.compared);
  w.put(u.changed);
  add_extension(extensions, kUniqueness, w.take());
}

bool take_uniqueness(Extensions& extensions, Uniqueness& u) {
  const auto bytes = take_extension(extensions, kUniqueness);
  if (!bytes) return true;
  ByteReader r(*bytes);
  u.known = true;
  u.runner_up = codec::get_frame(r);
  u.runner_up_inliers = r.get<std::uint16_t>();
  u.runner_up_probability = r.get<float>();
  u.alike = r.get<std::uint16_t>();
  u.differs = r.get<float>();
  u.compared = r.get<std::uint16_t>();
  u.changed = r.get<std::uint16_t>();
  return r.at_end() && u.changed <= u.compared;
}

void add_carried(Extensions& extensions, const FrameRange& carried) {
  if (carried.session == 0) return;
  ByteWriter w;
  w.put(carried.session);
  w.put(carried.first);
  w.put(carried.last);
  add_extension(extensions, kCarried, w.take());
}

bool take_carried(Extensions& extensions, FrameRange& carried) {
  const auto bytes = take_extension(extensions, kCarried);
  if (!bytes) return true;
  ByteReader r(*bytes);
  carried.session = r.get<SessionNumber>();
  carried.first = r.get<std::uint32_t>();
  carried.last = r.get<std::uint32_t>();
  constexpr std::uint32_t kMaxFrames = 1u << 16;  // frames
  return r.at_end() && carried.session != 0 && carried.first < carried.last &&
         carried.last - carried.first <= kMaxFrames;
}

void add_closure_tests(Extensions& extensions, const ClosureTests& tests) {
  if (tests == ClosureTests()) return;
  ByteWriter w;
  w.put(tests.opposing);
  w.put(static_cast<std::uint8_t>(tests.motion));
  w.put(tests.motion_sigma);
  add_extension(extensions, kEvidence, w.take());
}

bool take_closure_tests(Extensions& extensions, ClosureTests& tests) {
  const auto bytes = take_extension(extensions, kEvidence);
  if (!bytes) return true;
  ByteReader r(*bytes);
  tests.opposing = r.get<std::uint16_t>();
  tests.motion = r.get<MotionSays>();
  tests.motion_sigma = r.get<float>();
  return r.at_end() && tests.motion <= MotionSays::kContradicts;
}

void add_way_around(Extensions& extensions, const WayAround* around) {
  if (!around) return;
  ByteWriter w;
  codec::put(w, around->from);
  varint::put(w, around->T);
  varint::put(w, around->covariance, Matrix6::Zero());
  add_extension(extensions, kWayAround, w.take());
}

bool take_way_around(Extensions& extensions, std::shared_ptr<const WayAround>& around) {
  const auto bytes = take_extension(extensions, kWayAround);
  if (!bytes) return true;
  ByteReader r(*bytes);
  WayAround read;
  read.from = codec::get_frame(r);
  read.T = varint::get_se3(r);
  read.covariance = varint::get_matrix6(r, Matrix6::Zero());
  around = std::make_shared<const WayAround>(read);
  return r.at_end() && read.from.valid();
}

void add_unseen(Extensions& extensions, const std::vector<std::uint32_t>& unseen) {
  if (unseen.empty()) return;
  ByteWriter w;
  for (const std::uint32_t index : unseen) w.put(index);
  add_extension(extensions, kUnseen, w.take());
}

bool take_unseen(Extensions& extensions, std::vector<std::uint32_t>& unseen) {
  const auto bytes = take_extension(extensions, kUnseen);
  if (!bytes) return true;
  for (ByteReader r(*bytes); r.ok() && !r.at_end();) unseen.push_back(r.get<std::uint32_t>());
  return bytes->size() == unseen.size() * sizeof(std::uint32_t) && !unseen.empty() && unseen.size() <= kMaxUnseen &&
         std::is_sorted(unseen.begin(), unseen.end());
}

void add_unseen_place(Extensions& extensions, ClosureId closure) {
  if (!closure.valid()) return;
  ByteWriter w;
  codec::put(w, closure);
  add_extension(extensions, kUnseenPlace, w.take());
}

bool take_unseen_place(Extensions& extensions, ClosureId& closure) {
  const auto bytes = take_extension(extensions, kUnseenPlace);
  if (!bytes) return true;
  ByteReader r(*bytes);
  closure = codec::get_edge(r);
  return r.at_end() && closure.valid();
}

void add_map_identity(Extensions& extensions, const MapIdentity& identity) {
  if (!identity.known()) return;
  add_extension(extensions, kMapIdentity, {identity.uuid.bytes.begin(), identity.uuid.bytes.end()});
  ByteWriter w;
  w.put(identity.epoch);
  add_extension(extensions, kEpoch, w.take());
}

bool take_map_identity(Extensions& extensions, MapIdentity& identity) {
  const auto uuid = take_extension(extensions, kMapIdentity), epoch = take_extension(extensions, kEpoch);
  if (!uuid && !epoch) return true;
  if (!uuid || !epoch) return false;
  ByteReader r(*uuid), e(*epoch);
  r.get_array(identity.uuid.bytes.data(), identity.uuid.bytes.size());
  identity.epoch = e.get<std::uint64_t>();
  return r.at_end() && e.at_end() && identity.known();
}

void add_before_frozen(Extensions& extensions, SessionState state) {
  if (state == SessionState::kOpen) return;
  ByteWriter w;
  w.put(state);
  add_extension(extensions, kBeforeFrozen, w.take());
}

bool take_before_frozen(Extensions& extensions, SessionState& state) {
  const auto bytes = take_extension(extensions, kBeforeFrozen);
  if (!bytes) return true;
  ByteReader r(*bytes);
  state = r.get<SessionState>();
  return r.at_end() && state == SessionState::kEnded;
}

void add_shown(Extensions& extensions, std::uint64_t shown) {
  if (shown == 0) return;
  ByteWriter w;
  w.put(shown);
  add_extension(extensions, kShown, w.take());
}

bool take_shown(Extensions& extensions, std::uint64_t& shown) {
  const auto bytes = take_extension(extensions, kShown);
  if (!bytes) return true;
  ByteReader r(*bytes);
  shown = r.get<std::uint64_t>();
  return r.at_end() && shown != 0;
}

void add_digests_commit(Extensions& extensions, std::uint64_t commit) {
  if (commit == 0) return;
  ByteWriter w;
  w.put(commit);
  add_extension(extensions, kDigests, w.take());
}

bool take_digests_commit(Extensions& extensions, std::uint64_t& commit) {
  const auto bytes = take_extension(extensions, kDigests);
  if (!bytes) return true;
  ByteReader r(*bytes);
  commit = r.get<std::uint64_t>();
  return r.at_end() && commit != 0;
}

void add_digests_made(Extensions& extensions, const DigestsMade& made) {
  if (made.commit == 0) return;
  ByteWriter w;
  w.put(made.commit);
  w.put(made.through.session);
  w.put(made.through.chunk);
  w.put(made.frames);
  add_extension(extensions, kDigestsMade, w.take());
}

bool take_digests_made(Extensions& extensions, DigestsMade& made) {
  const auto bytes = take_extension(extensions, kDigestsMade);
  if (!bytes) return true;
  ByteReader r(*bytes);
  made.commit = r.get<std::uint64_t>();
  made.through.session = r.get<SessionNumber>();
  made.through.chunk = r.get<std::uint32_t>();
  made.frames = r.get<std::uint64_t>();
  return r.at_end() && made.commit != 0;
}

void add_edit_key(Extensions& extensions, const EditKey& edit) {
  if (edit.key.empty()) return;
  ByteWriter w;
  w.put(edit.content);
  w.put_bytes(as_bytes(edit.key));
  add_extension(extensions, kEditKey, w.take());
}

bool take_edit_key(Extensions& extensions, EditKey& edit) {
  const auto bytes = take_extension(extensions, kEditKey);
  if (!bytes) return true;
  ByteReader r(*bytes);
  edit.content = r.get<std::uint64_t>();
  if (!r.ok() || r.at_end() || bytes->size() > sizeof(edit.content) + kMaxEditKeyBytes) return false;
  edit.key.assign(bytes->begin() + sizeof(edit.content), bytes->end());
  return true;
}

void add_author(Extensions& extensions, const std::string& author) {
  if (!author.empty()) add_extension(extensions, kAuthor, {author.begin(), author.end()});
}

bool take_author(Extensions& extensions, std::string& author) {
  const auto bytes = take_extension(extensions, kAuthor);
  if (!bytes) return true;
  if (bytes->empty() || bytes->size() > kMaxAuthorBytes) return false;
  author.assign(bytes->begin(), bytes->end());
  return true;
}

void add_submission(Extensions& extensions, std::int64_t time_us, const std::string& author) {
  if (time_us != 0) {
    ByteWriter w;
    w.put(time_us);
    add_extension(extensions, kWallTime, w.take());
  }
  add_author(extensions, author);
}

bool take_submission(Extensions& extensions, std::int64_t& time_us, std::string& author) {
  if (const auto bytes = take_extension(extensions, kWallTime)) {
    ByteReader r(*bytes);
    time_us = r.get<std::int64_t>();
    if (!r.at_end() || time_us == 0) return false;
  }
  return take_author(extensions, author);
}

// Events that one record brought about were submitted together, so one entry says it of all of them.
void add_submissions(Extensions& extensions, const std::vector<EdgeEvent>& history) {
  ByteWriter times, authors;
  std::uint64_t timed = 0, authored = 0;  // the last event of each list
  std::uint64_t time_before = 0;
  const std::string* author_before = nullptr;
  for (std::size_t i = 0; i < history.size(); ++i) {
    const EdgeEvent& event = history[i];
    if (i > 0 && event.journal_sequence == history[i - 1].journal_sequence) continue;
    if (event.time_us != 0) {
      varint::put_unsigned(times, event.journal_sequence - timed);
      // Modulo 2^64, as it is read.
      const auto time = static_cast<std::uint64_t>(event.time_us);
      varint::put_signed(times, static_cast<std::int64_t>(time - time_before));
      timed = event.journal_sequence;
      time_before = time;
    }
    if (!event.author.empty()) {
      const bool same = author_before && *author_before == event.author;
      varint::put_unsigned(authors, event.journal_sequence - authored);
      varint::put_unsigned(authors, same ? 0 : event.author.size());
      if (!same) authors.put_bytes(as_bytes(event.author));
      authored = event.journal_sequence;
      author_before = &event.author;
    }
  }
  if (times.size() > 0) add_extension(extensions, kWallTime, times.take());
  if (authors.size() > 0) add_extension(extensions, kAuthor, authors.take());
}

bool take_submissions(Extensions& extensions, std::vector<EdgeEvent>& history) {
  const auto times = take_extension(extensions, kWallTime), authors = take_extension(extensions, kAuthor);
  const auto each_of = [&history](std::uint64_t sequence, auto change) {
    for (EdgeEvent& event : history)
      if (event.journal_sequence == sequence) change(event);
  };
  if (times) {
    ByteReader r(*times);
    std::uint64_t sequence = 0, time = 0;
    while (r.ok() && !r.at_end()) {
      const std::uint64_t before = std::exchange(sequence, sequence + varint::get_unsigned(r));
      time += static_cast<std::uint64_t>(varint::get_signed(r));
      if (sequence < before) return false;
      each_of(sequence, [&](EdgeEvent& event) { event.time_us = static_cast<std::int64_t>(time); });
    }
    if (!r.ok() || times->empty()) return false;
  }
  if (authors) {
    ByteReader r(*authors);
    std::uint64_t sequence = 0;
    std::string author;
    while (r.ok() && !r.at_end()) {
      const std::uint64_t before = std::exchange(sequence, sequence + varint::get_unsigned(r));
      const std::size_t length = varint::get_count(r);
      if (length > 0) {
        const auto bytes = r.get_bytes(length);
        author.assign(bytes.begin(), bytes.end());
      }
      if (sequence < before || author.empty() || author.size() > kMaxAuthorBytes) return false;
      each_of(sequence, [&](EdgeEvent& event) { event.author = author; });
    }
    if (!r.ok() || authors->empty()) return false;
  }
  return true;
}

}  // namespace relmap::storage::tags
