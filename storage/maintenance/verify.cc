#include "storage/maintenance/verify.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "storage/format/keys.h"
#include "storage/journal/journal_record.h"
#include "storage/maintenance/digest_check.h"
#include "storage/maintenance/frame_check.h"
#include "storage/maintenance/recount.h"
#include "storage/maintenance/references.h"
#include "storage/maintenance/skipped_cursor.h"
#include "storage/maintenance/stored_events.h"
#include "storage/maintenance/stored_sessions.h"

namespace relmap::storage {
namespace {

struct Stopped {};  // thrown where on_progress said so, caught in verify()

class Verifier {
 public:
  Verifier(const EngineSnapshot& snapshot, const VerifyOptions& options, const OnFinding& on_finding,
           const OnProgress& on_progress, const OnDifference& on_difference)
      : snapshot_(snapshot),
        options_(options),
        on_finding_(on_finding),
        on_progress_(on_progress),
        on_difference_(on_difference),
        stored_(load_sessions(snapshot)),
        graph_(snapshot, stored_.sessions, options.memory_bytes * 3 / 4) {}

  VerifySummary run() {
    try {
      check_sessions();
      walk_hot();
      check_coverage();
      walk_warm();
      recount();
      walk_appearance();
      check_labels();
      check_state();
      check_events();
    } catch (const Stopped&) {
      summary_.complete = false;
    }
    summary_.peak_bytes = graph_.peak_bytes() + table_.bytes() + recount_bytes_;
    return summary_;
  }

 private:
  bool chosen(SessionNumber session) const {
    return options_.sessions.empty() ||
           std::find(options_.sessions.begin(), options_.sessions.end(), session) != options_.sessions.end();
  }
  void find(Reason reason, FrameId frame, const std::string& what) {
    if (frame.session != 0 && !chosen(frame.session)) return;
    ++summary_.findings;
    if (on_finding_) on_finding_({reason, frame, what, false});
  }
  void find_damage(const PartDamage& damage) {
    FrameId frame;
    if (damage.slots != 0) frame = frame_in(damage.chunk, static_cast<std::uint32_t>(__builtin_ctzll(damage.slots)));
    if (chosen(damage.chunk.session)) find(Reason::DATA_LOSS, frame, damage.what);
  }
  Complain of(FrameId frame) {
    return [this, frame](const std::string& what) {
      find(Reason::CORRUPT, frame, "frame " + frame.to_string() + ": " + what);
    };
  }
  void progress(const char* step, std::uint64_t done, const char* unit = "frames") {
    if (on_progress_ && !on_progress_({step, done, frames_expected_, unit})) throw Stopped();
  }
  ChunkSpan span(SessionNumber number) const {
    const auto session = graph_.session(number);
    return session ? ChunkSpan{session->first / kFramesPerChunk, session->last / kFramesPerChunk} : ChunkSpan{};
  }

  void check_sessions() {
    for (const SessionDamage& damage : stored_.damage) {
      find(Reason::DATA_LOSS, {}, damage.what);
      if (damage.number != 0) numbers_.push_back(damage.number);
    }
    for (const SessionNumber number : stored_.unknown) {
      find(Reason::DATA_LOSS, {}, "record of session " + std::to_string(number) + ": missing");
      numbers_.push_back(number);
    }
    for (const Session& session : stored_.sessions) {
      numbers_.push_back(session.number);
      frames_expected_ += session.frames;
      if (!chosen(session.number)) continue;
      if (!is_deleted(session)) ++summary_.sessions;  // as SessionCounts does: a deleted session keeps its record
      check_session(session, [&](const std::string& what) {
        find(Reason::CORRUPT, {}, "session " + std::to_string(session.number) + ": " + what);
      });
    }
    std::sort(numbers_.begin(), numbers_.end());
  }

  // Checks every hot part by itself, with its checksum, and notes which frames exist.
  void walk_hot() {
    std::uint64_t done = 0;
    for (const SessionNumber number : numbers_)
      for_each_part<FrameHot>(snapshot_, number, span(number), [&](StoredPart<FrameHot> part) {
        std::uint64_t present = 0;
        for (const PartDamage& damage : part.damage) find_damage(damage);
        if (chosen(number)) digests_.check(part);
        for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
          if (!part.frames[slot]) continue;
          ++done;
          present |= std::uint64_t{1} << slot;
          if (chosen(number)) check_frame(frame_in(part.id, slot), *part.frames[slot]);
        }
        if (present != 0) table_.add(part.id, present);
        progress("hot parts", done);
        return true;
      });
    digests_.check_others(table_);
  }
  void check_frame(FrameId id, const FrameHot& frame) {
    ++summary_.frames;
    summary_.edges += frame.edges.size();
    summary_.landmarks += frame.landmarks.size();
    for (const Edge& edge : frame.edges)
      if (edge.kind == EdgeKind::kLoop) ++closures_[static_cast<std::size_t>(edge.state) - 1];
    check_hot(id, frame, of(id));
  }

  // Checks that each sequence below a session's next one is a frame or skipped.
  void check_coverage() {
    for (const Session& session : stored_.sessions)
      if (chosen(session.number)) check_coverage(session);
  }
  void check_coverage(const Session& session) {
    const std::string name = "session " + std::to_string(session.number) + ": ";
    std::uint64_t expected = 0, frames = 0, behind = 0, refused = 0, given_up = 0;
    const auto count = [&](const Skipped& item) {
      check_skipped(session, item, behind, [&](const std::string& what) { find(Reason::CORRUPT, {}, name + what); });
      behind = std::uint64_t{item.to} + 1;
      (item.refused ? refused : given_up) += behind - std::min<std::uint64_t>(item.from, behind);
    };
    std::optional<std::uint32_t> first, last;
    SkippedCursor skipped(snapshot_, session.number,
                          [&](const std::string&, const std::string& what) { find(Reason::DATA_LOSS, {}, what); });
    // Steps over skipped sequences, up to `index`. Returns false after each hole that it reports.
    const auto step_over = [&](std::uint64_t index) {
      for (; skipped.get() && skipped.get()->from <= expected; skipped.next()) {
        count(*skipped.get());
        expected = std::max(expected, behind);
      }
      if (expected < index) {
        const std::uint64_t hole = skipped.get() ? std::min<std::uint64_t>(index, skipped.get()->from) : index;
        find(Reason::DATA_LOSS, {session.number, static_cast<std::uint32_t>(expected)},
             name + "frames " + std::to_string(expected) + ".." + std::to_string(hole - 1) +
                 " are missing, and not recorded as skipped");
        expected = hole;
        return false;
      }
      return true;
    };
    for (const ChunkEntry& entry : table_.entries()) {
      if (entry.id.session != session.number) continue;
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
        if (!((entry.present >> slot) & 1)) continue;
        const FrameId frame = frame_in(entry.id, slot);
        if (!first) first = frame.index;
        last = frame.index;
        ++frames;
        while (!step_over(frame.index)) {
        }
        if (expected > frame.index)
          find(Reason::CORRUPT, frame, name + "frame " + frame.to_string() + " exists, and is recorded as skipped");
        expected = std::max<std::uint64_t>(expected, std::uint64_t{frame.index} + 1);
      }
    }
    while (!step_over(end_of(session))) {
    }
    for (; skipped.get(); skipped.next())
      if (is_going(session))
        count(*skipped.get());
      else
        find(Reason::CORRUPT, {},
             name + "sequence " + std::to_string(skipped.get()->to) + " is skipped and still expected");
    if (refused != session.refused || given_up != session.given_up)
      find(Reason::CORRUPT, {},
           name + "its record says " + std::to_string(session.refused) + " sequences refused, " +
               std::to_string(session.given_up) + " given up; there are " + std::to_string(refused) + ", " +
               std::to_string(given_up));
    gaps_found_ += given_up;
    if (frames > 0 && expected > session.next_sequence && expected <= std::numeric_limits<std::uint32_t>::max())
      find(Reason::CORRUPT, {}, name + "frames stand behind its next sequence");
    if (frames != session.frames || (frames > 0 && (*first != session.first || *last != session.last)))
      find(Reason::CORRUPT, {},
           name + "its record says " + std::to_string(session.frames) + " frames, " + std::to_string(session.first) +
               ".." + std::to_string(session.last) + "; there are " + std::to_string(frames) +
               (frames > 0 ? ", " + std::to_string(*first) + ".." + std::to_string(*last) : ""));
    frames_found_ += frames;
  }

  // Checks every warm part and all references.
  void walk_warm() {
    std::uint64_t done = 0;
    for (const SessionNumber number : numbers_)
      for_each_part<FrameWarm>(snapshot_, number, span(number), [&](StoredPart<FrameWarm> part) {
        for (const PartDamage& damage : part.damage) find_damage(damage);
        ChunkEntry* entry = table_.find(part.id);
        if (entry) entry->has_warm = true;
        refer(part.id, entry ? entry->present : 0, part, done);
        progress("references", done);
        return true;
      });
    for (const ChunkEntry& entry : table_.entries())
      if (!entry.has_warm) {
        refer(entry.id, entry.present, {}, done);
        progress("references", done);
      }
  }
  void refer(ChunkId id, std::uint64_t present, const StoredPart<FrameWarm>& warm, std::uint64_t& done) {
    const auto hot = graph_.hot_chunk(id);
    std::uint64_t damaged = 0;
    for (const PartDamage& damage : warm.damage) damaged |= damage.slots ? damage.slots : ~std::uint64_t{0};
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      const FrameId frame = frame_in(id, slot);
      const bool there = (present >> slot) & 1;
      if (there && hot->frames[slot]) {
        ++done;
        add_hot_references(graph_, table_, frame, *hot->frames[slot], of(frame));
        check_labels_of(frame, *hot->frames[slot]);
      }
      if (warm.frames[slot] && !there)
        find(Reason::CORRUPT, frame, "warm part of frame " + frame.to_string() + ": there is no such frame");
      if (!warm.frames[slot] && there && !((damaged >> slot) & 1))
        find(Reason::DATA_LOSS, frame, "warm part of frame " + frame.to_string() + ": missing");
      if (!warm.frames[slot] || !there) continue;
      if (chosen(id.session)) {
        summary_.observations += warm.frames[slot]->observations.size();
        check_warm(frame, *warm.frames[slot], of(frame));
      }
      add_observations(graph_, table_, paths_, frame, *warm.frames[slot], of(frame));
    }
  }

  void recount() {
    recount_bytes_ = recount_derived(
        snapshot_, graph_, table_, options_.memory_bytes / 4,
        [&](const Difference& difference) {
          find(Reason::CORRUPT, difference.frame, difference.what);
          if (on_difference_) on_difference_(difference);
        },
        [&](std::uint64_t done) { progress("what is derived", done); });
  }

  // Checks cold parts and words: as many features and words as each frame says.
  void walk_appearance() {
    std::uint64_t done = 0;
    for (const SessionNumber number : numbers_) {
      if (!chosen(number)) continue;
      walk_counted<FrameCold>(number, "cold parts", done, [&](FrameId id, const FrameCold& cold, std::size_t expected) {
        summary_.features += cold.appearance.size();
        check_cold(id, cold, of(id));
        if (cold.appearance.size() != expected)
          of(id)("it has " + std::to_string(cold.appearance.size()) + " features, and should have " +
                 std::to_string(expected));
      });
    }
    done = 0;
    for (const SessionNumber number : numbers_) {
      if (!chosen(number)) continue;
      // A frame without any is no finding: the daemon makes its words anew when it starts.
      walk_counted<FrameWords>(number, "words", done, [&](FrameId id, const FrameWords& words, std::size_t expected) {
        if (words.size() != expected && !words.empty())
          of(id)("it has " + std::to_string(words.size()) + " words, and should have " + std::to_string(expected));
      });
    }
  }
  template <typename Frame, typename Check>
  void walk_counted(SessionNumber number, const char* step, std::uint64_t& done, Check check) {
    const std::string name = std::string(part_name(kPartOf<Frame>)) + " part of frame ";
    auto next = std::lower_bound(table_.entries().begin(), table_.entries().end(), ChunkId{number, 0},
                                 [](const ChunkEntry& entry, ChunkId id) { return entry.id < id; });
    // A frame without features needs neither.
    const auto missing = [&](ChunkId id, std::uint64_t slots) {
      const auto hot = slots ? graph_.hot_chunk(id) : nullptr;
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
        if (((slots >> slot) & 1) && hot->frames[slot] && hot->frames[slot]->appearance_count > 0)
          find(Reason::DATA_LOSS, frame_in(id, slot), name + frame_in(id, slot).to_string() + ": missing");
    };
    for_each_part<Frame>(snapshot_, number, span(number), [&](StoredPart<Frame> part) {
      for (; next != table_.entries().end() && next->id < part.id; ++next) missing(next->id, next->present);
      std::uint64_t present = 0, expected = 0;
      if (next != table_.entries().end() && next->id == part.id) expected = next++->present;
      for (const PartDamage& damage : part.damage) {
        find_damage(damage);
        present |= damage.slots ? damage.slots : expected;
      }
      const auto hot = expected ? graph_.hot_chunk(part.id) : nullptr;
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
        if (!part.frames[slot]) continue;
        ++done;
        const FrameId frame = frame_in(part.id, slot);
        present |= std::uint64_t{1} << slot;
        if (hot && hot->frames[slot])
          check(frame, *part.frames[slot], hot->frames[slot]->appearance_count);
        else
          find(Reason::CORRUPT, frame, name + frame.to_string() + ": there is no such frame");
      }
      missing(part.id, expected & ~present);
      progress(step, done);
      return true;
    });
    for (; next != table_.entries().end() && next->id.session == number; ++next) missing(next->id, next->present);
  }

  // Labels are a fact of the frame. The index must have each of them, and no other.
  void check_labels_of(FrameId id, const FrameHot& frame) {
    for (const std::string& label : frame.labels) {
      const auto entry = snapshot_.get(keys::label(label, id));
      if (!entry.ok())
        find(Reason::DATA_LOSS, id, "index of label \"" + label + "\": " + entry.status().to_string());
      else if (!*entry)
        find(Reason::CORRUPT, id, "frame " + id.to_string() + ": its label \"" + label + "\" is not in the index");
    }
  }
  void check_labels() {
    const Status scanned = snapshot_.scan(keys::labels_beginning(""), [&](std::string_view key, ByteSpan) {
      const auto entry = keys::label_of(key);
      const auto hot = entry ? graph_.hot(entry->frame) : nullptr;
      if (!entry)
        find(Reason::CORRUPT, {}, "index of labels: a key that cannot be read");
      else if (!hot || std::find(hot->labels.begin(), hot->labels.end(), entry->label) == hot->labels.end())
        find(Reason::CORRUPT, entry->frame,
             "index of label \"" + entry->label + "\": frame " + entry->frame.to_string() + " does not have it");
      return true;
    });
    if (!scanned.ok()) find(Reason::DATA_LOSS, {}, "index of labels: " + scanned.to_string());
  }

  // Checks that frames that wait for work exist, and that the counters are right.
  void check_state() {
    for (const PendingDamage& damage : stored_.pending_damage) find(Reason::DATA_LOSS, {}, damage.what);
    if (!stored_.state_damage.empty()) find(Reason::DATA_LOSS, {}, "the map's state: " + stored_.state_damage);
    if (!stored_.state || !options_.sessions.empty()) return;
    const MapState& state = *stored_.state;
    for (const auto& [chunk, frames] : stored_.pending.chunks())
      for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
        if (const FrameId frame = frame_in(chunk, slot); ((frames >> slot) & 1) && !table_.has(frame))
          find(Reason::CORRUPT, frame, "frame " + frame.to_string() + " waits for relaxation and is not there");
    for (const FrameId frame : state.lookups)
      if (!table_.has(frame))
        find(Reason::CORRUPT, frame, "frame " + frame.to_string() + " waits for its lookup and is not there");
    const auto counter = [&](const char* name, std::uint64_t stored, std::uint64_t counted) {
      if (stored != counted)
        find(Reason::CORRUPT, {},
             std::string("the map's state: ") + std::to_string(stored) + " " + name + ", counted " +
                 std::to_string(counted));
    };
    counter("keyframes", state.keyframes, frames_found_);
    counter("sequences given up", state.gaps, gaps_found_);
    const std::uint64_t closures[] = {state.closures_candidate, state.closures_accepted, state.closures_quarantined,
                                      state.closures_removed};
    static constexpr const char* kNames[] = {"candidate closures", "accepted closures", "quarantined closures",
                                             "removed closures"};
    for (std::size_t i = 0; i < 4; ++i) counter(kNames[i], closures[i], closures_[i]);
  }

  void check_events() {
    if (!options_.sessions.empty()) return;
    const std::uint64_t applied = stored_.state ? stored_.state->applied_sequence : ~std::uint64_t{0};
    (void)storage::check_events(snapshot_, applied,
                                [&](const EventDamage& damage) { find(damage.reason, {}, damage.what); });
  }

  const EngineSnapshot& snapshot_;
  const VerifyOptions& options_;
  const OnFinding& on_finding_;
  const OnProgress& on_progress_;
  const OnDifference& on_difference_;
  const StoredSessions stored_;
  const StoredGraph graph_;
  const DigestCheck digests_{snapshot_, stored_.state,
                             [this](const Finding& finding) { find(finding.reason, finding.frame, finding.what); }};
  SightedPaths paths_{graph_};
  std::vector<SessionNumber> numbers_;  // of sessions that have a record, or frames
  ChunkTable table_;
  std::uint64_t frames_expected_ = 0, frames_found_ = 0, gaps_found_ = 0;
  std::array<std::uint64_t, 4> closures_{};  // by state
  std::size_t recount_bytes_ = 0;
  VerifySummary summary_;
};

}  // namespace

VerifyOptions beside_others(VerifyOptions options, const Budget& budget, Share share) {
  options.memory_bytes = std::min(options.memory_bytes, budget.allowance(share) / 2);
  return options;
}

Result<VerifySummary> verify(const EngineSnapshot& snapshot, const VerifyOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress, const OnDifference& on_difference) try {
  return Verifier(snapshot, options, on_finding, on_progress, on_difference).run();
} catch (const StatusError& error) {
  return error.status();
}

Result<VerifySummary> verify(const EngineSnapshot& snapshot, const VerifyOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress) {
  return verify(snapshot, options, on_finding, on_progress, {});
}

Result<VerifySummary> verify(const MapView& view, const VerifyOptions& options, const OnFinding& on_finding,
                             const OnProgress& on_progress) {
  return verify(*view.committed(), options, on_finding, on_progress);
}

Result<VerifySummary> verify_journal(const Engine& engine, const OnFinding& on_finding, const OnProgress& on_progress) {
  VerifySummary summary;
  const auto find = [&](Reason reason, const std::string& what) {
    ++summary.findings;
    if (on_finding) on_finding({reason, {}, what, false});
  };
  const std::uint64_t from = engine.applied_sequence() + 1, last = engine.last_journal_sequence();
  std::uint64_t next = from;
  // Records that were applied and trimmed meanwhile do not count as missing.
  const auto missing_before = [&](std::uint64_t sequence) {
    if (next < sequence) next = std::max(next, std::min(sequence, engine.first_journal_sequence()));
    if (next < sequence)
      find(Reason::DATA_LOSS,
           "journal records " + std::to_string(next) + ".." + std::to_string(sequence - 1) + " are missing");
    next = sequence;
  };
  const Status read = engine.read_journal(from, [&](std::uint64_t sequence, ByteSpan record) {
    missing_before(sequence);
    ++next;
    if (const auto decoded = decode_record(record); !decoded.ok())
      find(Reason::DATA_LOSS, "journal record " + std::to_string(sequence) + ": " + decoded.status().to_string());
    ++summary.journal_records;
    summary.complete = !on_progress || on_progress({"journal", next - from, last + 1 - from, "records"});
    return summary.complete;
  });
  if (read.reason() == Reason::DATA_LOSS)
    find(Reason::DATA_LOSS, read.message());
  else if (!read.ok())
    return read;
  else if (summary.complete)
    missing_before(last + 1);
  return summary;
}

}  // namespace relmap::storage
