#include "storage/maintenance/rewrite.h"

#include <algorithm>
#include <map>
#include <set>

#include "storage/format/chunk_codec.h"
#include "storage/format/frame_codec.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/maintenance/skipped_cursor.h"
#include "storage/maintenance/stored_events.h"
#include "storage/maintenance/stored_graph.h"
#include "storage/maintenance/stored_parts.h"
#include "storage/maintenance/stored_sessions.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kBatchBytes = std::size_t{8} << 20;

void encode(ByteWriter& w, FrameId id, const FrameHot& frame) { encode_hot(w, id, frame); }
void encode(ByteWriter& w, FrameId id, const FrameWarm& frame) { encode_warm(w, id, frame); }
void encode(ByteWriter& w, FrameId, const FrameCold& frame) { encode_cold(w, frame); }
void encode(ByteWriter& w, FrameId, const FrameWords& words) { encode_words(w, words); }

class Rewriter {
 public:
  Rewriter(Engine& engine, std::uint64_t epoch, Quarantine& quarantine, RepairSummary& summary, const OnFinding& told,
           const OnProgress& on_progress)
      : engine_(engine),
        epoch_(epoch),
        snapshot_(engine.snapshot()),
        quarantine_(quarantine),
        summary_(summary),
        told_(told),
        on_progress_(on_progress) {}

  void run() {
    StoredSessions stored = load_sessions(*snapshot_);
    for (const SessionDamage& damage : stored.damage) lose_session(damage.number, damage.key, damage.what);
    for (const SessionNumber number : stored.unknown)
      lose_session(number, "", "record of session " + std::to_string(number) + ": missing");
    for (const Session& session : stored.sessions) {
      known_.insert(session.number);
      mend_session(session);
    }
    mend_labels();
    mend_pending(stored);
    mend_state(stored);
    mend_events(stored.state ? stored.state->applied_sequence : engine_.applied_sequence());
    commit();
  }

 private:
  void tell(Reason reason, FrameId frame, const std::string& what) {
    summary_.changed = true;
    if (told_) told_({reason, frame, what, true});
  }
  void progress(const char* step, std::uint64_t done) {
    if (on_progress_ && !on_progress_({step, done, 0, "chunks"}))
      throw StatusError(Status(Reason::SHUTTING_DOWN, "the repair was stopped; it can be run again"));
  }

  // Moves a value to quarantine, if it can be read at all, and removes it from the map.
  void remove(const std::string& key, const std::string& name) {
    const auto value = snapshot_->get(key);
    if (value.ok() && !*value) return;
    if (value.ok())
      if (Status kept = quarantine_.keep(name, **value); !kept.ok()) throw StatusError(kept);
    deletes_.insert(key);
  }
  static std::string name_of(Part part, ChunkId id, const std::string& key) {
    std::string name = std::string(part_name(part)) + "-" + std::to_string(id.session) + "-" + std::to_string(id.chunk);
    if (key.size() > keys::kChunkKey) name += "-" + std::to_string(static_cast<std::uint8_t>(key.back()));
    return name;
  }
  void put(const std::string& key, Bytes value) {
    batch_bytes_ += key.size() + value.size();
    puts_[key] = std::move(value);
  }
  void commit() {
    if (puts_.empty() && deletes_.empty()) return;
    std::vector<Put> puts;
    for (auto& [key, value] : puts_) {
      deletes_.erase(key);
      puts.push_back({key, std::move(value)});
    }
    const std::vector<std::string> deletes(deletes_.begin(), deletes_.end());
    const Status committed = engine_.commit(epoch_, engine_.applied_sequence(), puts, deletes);
    throw_if(committed);
    puts_.clear();
    deletes_.clear();
    batch_bytes_ = 0;
  }

  // Without a session's record nobody knows the robot, the camera or the uuid, so its frames cannot be used.
  void lose_session(SessionNumber number, const std::string& key, const std::string& what) {
    if (number != 0) summary_.lost_sessions.push_back(number);
    tell(Reason::DATA_LOSS, {}, what + "; the session is lost, its frames are kept in quarantine");
    if (!key.empty()) remove(key, "session-" + std::to_string(number));
    if (number == 0) return;
    (void)snapshot_->scan(keys::skipped_in(number), [&](std::string_view skipped, ByteSpan) {
      deletes_.insert(std::string(skipped));
      return true;
    });
    lose_parts<FrameHot>(number);
    lose_parts<FrameWarm>(number);
    lose_parts<FrameCold>(number);
    lose_parts<FrameWords>(number);
  }
  template <typename Frame>
  void lose_parts(SessionNumber number) {
    for_each_part<Frame>(*snapshot_, number, {}, [&](StoredPart<Frame> part) {
      for (const std::string& k : part.keys) remove(k, name_of(kPartOf<Frame>, part.id, k));
      progress("lost sessions", part.id.chunk);
      return true;
    });
  }

  // Finds the chunks that need work, and then does it.
  void mend_session(const Session& session) {
    const ChunkSpan span{session.first / kFramesPerChunk, session.last / kFramesPerChunk};
    std::map<std::uint32_t, std::uint64_t> present;  // frames by chunk
    std::set<std::uint32_t> broken;
    for_each_part<FrameHot>(*snapshot_, session.number, span, [&](StoredPart<FrameHot> part) {
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
        if (part.frames[slot]) {
          if (!part.frames[slot]->present) broken.insert(part.id.chunk);
          index_labels(frame_in(part.id, slot), *part.frames[slot]);
        }
      if (part.present() != 0) present[part.id.chunk] = part.present();
      if (!part.damage.empty()) broken.insert(part.id.chunk);
      progress("hot parts", part.id.chunk);
      return true;
    });
    find_broken<FrameWarm>(session, span, present, broken);
    find_broken<FrameCold>(session, span, present, broken);
    find_broken<FrameWords>(session, span, present, broken);

    const std::uint32_t last_chunk = present.empty() ? 0 : present.rbegin()->first;
    const bool has_open = !present.empty() && !is_going(session);
    if (has_open && is_gathered({session.number, last_chunk})) broken.insert(last_chunk);
    for (const std::uint32_t chunk : broken) {
      mend_chunk({session.number, chunk}, has_open && chunk == last_chunk);
      if (batch_bytes_ > kBatchBytes) commit();
    }
    mend_record(session, present);
  }
  template <typename Frame>
  void find_broken(const Session& session, ChunkSpan span, const std::map<std::uint32_t, std::uint64_t>& present,
                   std::set<std::uint32_t>& broken) {
    auto next = present.begin();
    const auto absent = [&](const std::map<std::uint32_t, std::uint64_t>::value_type& chunk, std::uint64_t slots) {
      if (needed<Frame>({session.number, chunk.first}, slots)) broken.insert(chunk.first);
    };
    for_each_part<Frame>(*snapshot_, session.number, span, [&](StoredPart<Frame> part) {
      for (; next != present.end() && next->first < part.id.chunk; ++next) absent(*next, next->second);
      const bool known = next != present.end() && next->first == part.id.chunk;
      const std::uint64_t expected = known ? next->second : 0, there = part.present();
      if (known) absent(*next++, expected & ~there);
      if (!part.damage.empty() || (there & ~expected) != 0 || !counts_agree(part)) broken.insert(part.id.chunk);
      progress(part_name(kPartOf<Frame>).data(), part.id.chunk);
      return true;
    });
    for (; next != present.end(); ++next) absent(*next, next->second);
  }
  // Every frame needs a warm part, be it empty. A frame without features needs neither a cold part nor words.
  template <typename Frame>
  bool needed(ChunkId id, std::uint64_t slots) {
    if (slots == 0 || kPartOf<Frame> == Part::kWarm) return slots != 0;
    const auto hot = load_part<FrameHot>(*snapshot_, id);
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
      if (((slots >> slot) & 1) && hot.frames[slot] && hot.frames[slot]->appearance_count > 0) return true;
    return false;
  }
  // Whether there are as many features or words as the frames say.
  template <typename Frame>
  bool counts_agree(const StoredPart<Frame>& part) {
    if constexpr (kPartOf<Frame> == Part::kCold || kPartOf<Frame> == Part::kWords) {
      const auto hot = load_part<FrameHot>(*snapshot_, part.id);
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
        if (part.frames[slot] && hot.frames[slot] && !agrees(*part.frames[slot], hot.frames[slot]->appearance_count))
          return false;
    }
    return true;
  }
  static bool agrees(const FrameCold& cold, std::size_t count) { return cold.appearance.size() == count; }
  static bool agrees(const FrameWords& words, std::size_t count) { return words.empty() || words.size() == count; }

  bool is_gathered(ChunkId id) {
    const auto value = snapshot_->get(keys::part(Part::kHot, id));
    return !value.ok() || *value;
  }

  void mend_chunk(ChunkId id, bool open) {
    auto hot = load_part<FrameHot>(*snapshot_, id);
    auto warm = load_part<FrameWarm>(*snapshot_, id);
    auto cold = load_part<FrameCold>(*snapshot_, id);
    auto words = load_part<FrameWords>(*snapshot_, id);
    tell_damage(hot), tell_damage(warm), tell_damage(cold), tell_damage(words);
    bool hot_lost = !hot.damage.empty(), warm_lost = !warm.damage.empty();
    bool hot_changed = false, warm_changed = false;
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      const FrameId frame = frame_in(id, slot);
      if (hot.frames[slot] && !hot.frames[slot]->present) hot.frames[slot] = nullptr, hot_lost = true;
      if (!hot.frames[slot]) {
        warm_lost = drop(warm, slot) || warm_lost;
        drop(cold, slot), drop(words, slot);
        continue;
      }
      if (!warm.frames[slot]) {
        tell(Reason::DATA_LOSS, frame, "frame " + frame.to_string() + ": its observations are lost");
        ++summary_.frames_without_observations;
        warm.frames[slot] = std::make_shared<FrameWarm>();
        warm_changed = true;
      }
      const std::uint32_t features = mend_appearance(frame, hot.frames[slot], cold.frames[slot].get(), hot_changed);
      const bool words_agree = words.frames[slot] ? agrees(*words.frames[slot], features) : features == 0;
      if (words_agree) continue;
      if (features > 0) {
        tell(Reason::DATA_LOSS, frame,
             "frame " + frame.to_string() + ": its words are lost, and made anew when the daemon starts");
        ++summary_.frames_without_words;
      }
      put(keys::frame(Part::kWords, frame), single(frame, FrameWords{}));
    }
    const bool reshape = open && is_gathered(id);
    if (hot_lost || hot_changed || reshape) store(hot, open, hot_lost);
    if (warm_lost || warm_changed || reshape) store(warm, open, warm_lost);
    summary_.changed = summary_.changed || reshape;
    move_away(cold), move_away(words);
  }
  // Returns the number of the frame's features, and makes the hot part say the same.
  std::uint32_t mend_appearance(FrameId id, std::shared_ptr<const FrameHot>& hot, const FrameCold* cold,
                                bool& hot_changed) {
    const auto features = static_cast<std::uint32_t>(cold ? cold->appearance.size() : 0);
    if (features == hot->appearance_count) return features;
    if (cold) {
      tell(Reason::CORRUPT, id, "frame " + id.to_string() + ": it says another number of features than it has");
    } else {
      tell(Reason::DATA_LOSS, id, "frame " + id.to_string() + ": its appearance is lost");
      ++summary_.frames_without_appearance;
      put(keys::frame(Part::kCold, id), single(id, FrameCold{}));
    }
    auto mended = std::make_shared<FrameHot>(*hot);
    mended->appearance_count = features;
    hot = std::move(mended);
    hot_changed = true;
    return features;
  }
  template <typename Frame>
  void tell_damage(const StoredPart<Frame>& part) {
    for (const PartDamage& damage : part.damage) tell(Reason::DATA_LOSS, first_frame(damage), damage.what);
  }
  static FrameId first_frame(const PartDamage& damage) {
    if (damage.slots == 0) return {};
    return frame_in(damage.chunk, static_cast<std::uint32_t>(__builtin_ctzll(damage.slots)));
  }
  // Drops a part of a frame that does not exist. Returns true if there was one.
  template <typename Frame>
  bool drop(StoredPart<Frame>& part, std::uint32_t slot) {
    if (!part.frames[slot]) return false;
    part.frames[slot] = nullptr;
    const FrameId frame = frame_in(part.id, slot);
    constexpr Part kPart = kPartOf<Frame>;
    tell(Reason::CORRUPT, frame,
         std::string(part_name(kPart)) + " part of frame " + frame.to_string() + ": there is no such frame");
    if (kPart == Part::kCold || kPart == Part::kWords) {
      const std::string key = keys::frame(kPart, frame);
      remove(key, name_of(kPart, part.id, key));
    }
    return true;
  }
  // Moves the damaged records of a part that is always stored frame by frame.
  template <typename Frame>
  void move_away(const StoredPart<Frame>& part) {
    for (const PartDamage& damage : part.damage) remove(damage.key, name_of(kPartOf<Frame>, part.id, damage.key));
  }
  template <typename Frame>
  Bytes single(FrameId frame, const Frame& value) {
    ByteWriter body;
    encode(body, frame, value);
    return frame_container(kPartOf<Frame>, frame, snapshot_->commit_number() + 1, body.bytes());
  }
  // Writes a hot or warm part anew in place of all that stood there, which goes to quarantine if some of it is lost.
  template <typename Frame>
  void store(const StoredPart<Frame>& part, bool open, bool lost) {
    constexpr Part kPart = kPartOf<Frame>;
    for (const std::string& key : part.keys)
      if (lost)
        remove(key, name_of(kPart, part.id, key));
      else
        deletes_.insert(key);
    PartWriter writer(kPart, part.id, snapshot_->commit_number() + 1);
    bool any = false;
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      if (!part.frames[slot]) continue;
      any = true;
      if (open) {
        put(keys::frame(kPart, frame_in(part.id, slot)), single(frame_in(part.id, slot), *part.frames[slot]));
        continue;
      }
      ByteWriter body;
      encode(body, frame_in(part.id, slot), *part.frames[slot]);
      writer.add(slot, body.bytes());
    }
    if (any && !open) put(keys::part(kPart, part.id), writer.finish());
  }

  // Makes the session's record say what is there. A sequence that is neither there nor skipped is recorded as lost.
  void mend_record(const Session& session, const std::map<std::uint32_t, std::uint64_t>& present) {
    Session mended = session;
    mended.frames = mended.first = mended.last = 0;
    mended.refused = mended.given_up = 0;
    SkippedCursor old(*snapshot_, session.number, [&](const std::string& key, const std::string& what) {
      if (key.empty()) throw StatusError(Status(Reason::IO_ERROR, what));  // the records behind it must not be lost
      tell(Reason::DATA_LOSS, {}, what);
      remove(key, "skipped-" + std::to_string(session.number));
    });
    bool intact = false,
         changed = false;  // `intact`: the record at `old` stays as it is; `changed`: some record does not
    const auto pass = [&] {
      if (!intact) deletes_.insert(keys::skipped(session.number, old.get()->to)), changed = true;
      intact = false;
      old.next();
    };
    std::uint64_t next = 0;
    // Records the absent sequences next..end - 1 as skipped. Those that were skipped before stay so.
    const auto record_absent = [&](std::uint64_t end) {
      while (next < end) {
        while (old.get() && (old.get()->to < next || old.get()->from > old.get()->to)) pass();
        const bool known = old.get() && old.get()->from <= next;
        std::uint64_t to = end - 1;
        if (known)
          to = std::min<std::uint64_t>(to, old.get()->to);
        else if (old.get())
          to = std::min<std::uint64_t>(to, old.get()->from - 1);
        Skipped item = known ? *old.get() : Skipped{0, 0, 0, false, Reason::DATA_LOSS};
        if (!is_reason(static_cast<std::uint16_t>(item.reason))) item.reason = Reason::DATA_LOSS;
        item.from = static_cast<std::uint32_t>(next);
        item.to = static_cast<std::uint32_t>(to);
        (item.refused ? mended.refused : mended.given_up) += to - next + 1;
        if (known && item == *old.get())
          intact = true;
        else
          put(keys::skipped(session.number, item.to), encode_skipped(item)), changed = true;
        if (!known) lose_frames({session.number, item.from, item.to});
        next = to + 1;
      }
    };
    for (const auto& [chunk, slots] : present)
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
        if (!((slots >> slot) & 1)) continue;
        const FrameId frame = frame_in({session.number, chunk}, slot);
        record_absent(frame.index);
        next = std::uint64_t{frame.index} + 1;
        if (mended.frames++ == 0) mended.first = frame.index;
        mended.last = frame.index;
      }
    record_absent(end_of(session));
    if (is_going(session)) {  // what was skipped behind its end stays recorded, though the frames have been removed
      for (; old.get() && old.get()->from <= old.get()->to; old.next())
        (old.get()->refused ? mended.refused : mended.given_up) += std::uint64_t{old.get()->to} - old.get()->from + 1;
    } else {
      mended.next_sequence = static_cast<std::uint32_t>(next);
    }
    while (old.get()) pass();
    mend_times(mended, present);
    keyframes_ += mended.frames;
    gaps_ += mended.given_up;
    const bool record = encode_session(mended) != encode_session(session);
    if (record || changed)
      tell(Reason::CORRUPT, {}, "session " + std::to_string(session.number) + ": its record was mended");
    if (record) put(keys::session(session.number), encode_session(mended));
  }
  void mend_times(Session& session, const std::map<std::uint32_t, std::uint64_t>& present) {
    if (present.empty()) return;
    const auto time_of = [&](std::uint32_t index) {
      const FrameId id{session.number, index};
      return load_part<FrameHot>(*snapshot_, chunk_id(id)).frames[slot_of(id)]->time_us;
    };
    session.first_time_us = time_of(session.first);
    session.last_time_us = time_of(session.last);
  }
  void lose_frames(FrameRange range) {
    summary_.lost_frames.push_back(range);
    tell(Reason::DATA_LOSS, {range.session, range.first},
         "frames " + FrameId{range.session, range.first}.to_string() + ".." + std::to_string(range.last) +
             " are lost; they are recorded as a gap");
  }

  // The index has every label of every frame, and no other.
  void index_labels(FrameId id, const FrameHot& frame) {
    for (const std::string& label : frame.labels) {
      const std::string key = keys::label(label, id);
      const auto entry = snapshot_->get(key);
      if (entry.ok() && *entry) continue;
      tell(Reason::CORRUPT, id, "frame " + id.to_string() + ": its label \"" + label + "\" was not in the index");
      ++summary_.rebuilt;
      put(key, {});
    }
  }
  void mend_labels() {
    const StoredGraph graph(*snapshot_, {}, kBatchBytes);
    (void)snapshot_->scan(keys::labels_beginning(""), [&](std::string_view key, ByteSpan) {
      const auto entry = keys::label_of(key);
      const auto hot = entry && known_.contains(entry->frame.session) ? graph.hot(entry->frame) : nullptr;
      if (hot && std::find(hot->labels.begin(), hot->labels.end(), entry->label) != hot->labels.end()) return true;
      tell(Reason::CORRUPT, entry ? entry->frame : FrameId{}, "an entry of the index of labels that no frame has");
      ++summary_.rebuilt;
      deletes_.insert(std::string(key));
      return true;
    });
  }

  void mend_pending(const StoredSessions& stored) {
    for (const PendingDamage& damage : stored.pending_damage) {
      tell(Reason::DATA_LOSS, {}, damage.what + "; they wait no longer");
      if (!damage.key.empty()) remove(damage.key, "pending");
    }
  }
  // What is damaged is dropped: those who follow the log are told that something is missing.
  void mend_events(std::uint64_t applied_sequence) {
    bool damaged = false;
    const auto head = check_events(*snapshot_, applied_sequence, [&](const EventDamage& damage) {
      tell(damage.reason, {}, damage.what + (damage.head ? "; mended" : "; dropped from the log"));
      damaged = true;
      if (!damage.key.empty() && !damage.head) remove(damage.key, "events");
    });
    if (damaged && head) put(std::string(keys::all_events()), encode_event_head(*head));
  }
  void mend_state(const StoredSessions& stored) {
    if (!stored.state && stored.state_damage.empty()) return;  // a map that was never committed
    MapState state = stored.state.value_or(MapState{});
    if (!stored.state) state.applied_sequence = engine_.applied_sequence();
    state.keyframes = keyframes_;
    state.gaps = gaps_;
    if (stored.state && encode_state(state) == encode_state(*stored.state)) return;
    if (stored.state) {
      tell(Reason::CORRUPT, {}, "the map's state: its counters were mended");
    } else {
      tell(
          Reason::DATA_LOSS, {},
          "the map's state: " + stored.state_damage +
              "; its counters were made anew, its words need relmap-admin reindex, and robots take it for another map");
      remove(keys::map_state(), "state");
    }
    put(keys::map_state(), encode_state(state));
  }

  Engine& engine_;
  const std::uint64_t epoch_;
  const std::shared_ptr<const EngineSnapshot> snapshot_;
  Quarantine& quarantine_;
  RepairSummary& summary_;
  const OnFinding& told_;
  const OnProgress& on_progress_;
  std::set<SessionNumber> known_;
  std::map<std::string, Bytes> puts_;
  std::set<std::string> deletes_;
  std::size_t batch_bytes_ = 0;
  std::uint64_t keyframes_ = 0, gaps_ = 0;
};

}  // namespace

Status rewrite_broken_parts(Engine& engine, std::uint64_t epoch, Quarantine& quarantine, RepairSummary& summary,
                            const OnFinding& told, const OnProgress& on_progress) try {
  Rewriter(engine, epoch, quarantine, summary, told, on_progress).run();
  return {};
} catch (const StatusError& error) {
  return error.status();
}

}  // namespace relmap::storage
