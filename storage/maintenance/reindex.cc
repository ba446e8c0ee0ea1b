#include "storage/maintenance/reindex.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "storage/format/chunk_codec.h"
#include "storage/format/frame_codec.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/maintenance/stored_parts.h"
#include "storage/maintenance/stored_sessions.h"

namespace relmap::storage {
namespace {

constexpr std::uint32_t kNoVocabulary = 0;

class Reindexer {
 public:
  Reindexer(Engine& engine, const WordFunction& words, const OnFinding& on_finding, const OnProgress& on_progress)
      : engine_(engine),
        words_(words),
        on_finding_(on_finding),
        on_progress_(on_progress),
        snapshot_(engine.snapshot()) {}

  ReindexSummary run(std::uint32_t vocabulary_crc) {
    const StoredSessions stored = load_sessions(*snapshot_);
    check(stored);
    state_ = stored.state.value_or(MapState{});
    digests_hold_ = state_.digests_commit == last_commit_;
    summary_.former_crc = state_.vocabulary_crc;
    summary_.frames = state_.keyframes;
    if (summary_.frames == 0 || state_.vocabulary_crc == vocabulary_crc) return summary_;

    epoch_ = engine_.acquire().or_throw();
    summary_.changed = true;
    say_vocabulary(kNoVocabulary);
    for (const Session& session : stored.sessions) remake(session);
    say_vocabulary(vocabulary_crc);
    summary_.without_appearance =
        summary_.frames - std::min(summary_.frames, summary_.with_words + summary_.unreadable);
    return summary_;
  }

 private:
  static void check(const StoredSessions& stored) {
    std::string what;
    if (!stored.state_damage.empty()) what = "the map's state: " + stored.state_damage;
    if (!stored.damage.empty()) what = stored.damage.front().what;
    if (!stored.unknown.empty()) what = "record of session " + std::to_string(stored.unknown.front()) + ": missing";
    if (!what.empty()) throw StatusError(Status(Reason::DATA_LOSS, what + "; the map must be repaired first"));
  }

  void say_vocabulary(std::uint32_t crc) {
    if (state_.vocabulary_crc == crc) return;
    state_.vocabulary_crc = crc;
    state_.digests_commit = digests_hold_ ? last_commit_ + 1 : 0;  // they have nothing to do with words
    commit({{keys::map_state(), encode_state(state_)}}, {});
  }

  // Goes through the chunks in which a daemon looks for words.
  void remake(const Session& session) {
    if (session.frames == 0) return;
    const std::uint32_t last = chunk_of({session.number, session.last});
    for (ChunkId chunk = chunk_id({session.number, session.first}); chunk.chunk <= last; ++chunk.chunk) remake(chunk);
  }

  void remake(ChunkId chunk) {
    const auto cold = load_part<FrameCold>(*snapshot_, chunk);
    for (const PartDamage& damage : cold.damage) lose(damage);
    const auto words = words_of(cold);
    std::vector<Put> puts;
    std::vector<std::string> deletes = load_part<FrameWords>(*snapshot_, chunk).keys;
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      if (words[slot].empty()) continue;
      const FrameId frame = frame_in(chunk, slot);
      std::string key = keys::frame(Part::kWords, frame);
      std::erase(deletes, key);
      ByteWriter body;
      encode_words(body, words[slot]);
      puts.push_back({std::move(key), frame_container(Part::kWords, frame, last_commit_ + 1, body.bytes())});
    }
    if (!puts.empty() || !deletes.empty()) commit(puts, deletes);
    summary_.with_words += puts.size();
    if (on_progress_ && !on_progress_({"words", summary_.with_words, summary_.frames, "frames"}))
      throw StatusError(Status(Reason::SHUTTING_DOWN, "the words are made anew in part; run it again"));
  }

  std::array<FrameWords, kFramesPerChunk> words_of(const StoredPart<FrameCold>& cold) const {
    std::array<FrameWords, kFramesPerChunk> words;
    std::atomic<std::uint32_t> next = 0;
    const auto work = [&] {
      for (std::uint32_t slot; (slot = next++) < kFramesPerChunk;)
        if (cold.frames[slot]) words[slot] = words_(cold.frames[slot]->appearance);
    };
    std::vector<std::future<void>> others;
    for (unsigned n = 1; n < std::thread::hardware_concurrency(); ++n)
      others.push_back(std::async(std::launch::async, work));
    work();
    for (auto& other : others) other.get();
    return words;
  }

  // The frames get no words, since those of the former vocabulary would be mistaken for words of this one.
  void lose(const PartDamage& damage) {
    const auto frames = static_cast<std::uint64_t>(__builtin_popcountll(damage.slots));
    summary_.unreadable += frames == 0 ? 1 : frames;
    if (!on_finding_) return;
    const FrameId frame = damage.slots == 0
                              ? FrameId{}
                              : frame_in(damage.chunk, static_cast<std::uint32_t>(__builtin_ctzll(damage.slots)));
    on_finding_({Reason::DATA_LOSS, frame, damage.what + "; it has no words now"});
  }

  void commit(const std::vector<Put>& puts, const std::vector<std::string>& deletes) {
    const Status done = engine_.commit(epoch_, engine_.applied_sequence(), puts, deletes);
    throw_if(done);
    ++last_commit_;
  }

  Engine& engine_;
  const WordFunction& words_;
  const OnFinding& on_finding_;
  const OnProgress& on_progress_;
  const std::shared_ptr<const EngineSnapshot> snapshot_;
  MapState state_;
  std::uint64_t epoch_ = 0, last_commit_ = snapshot_->commit_number();
  bool digests_hold_ = false;
  ReindexSummary summary_;
};

}  // namespace

Result<ReindexSummary> reindex(const std::shared_ptr<Engine>& engine, const WordFunction& words,
                               std::uint32_t vocabulary_crc, const OnFinding& on_finding,
                               const OnProgress& on_progress) try {
  return Reindexer(*engine, words, on_finding, on_progress).run(vocabulary_crc);
} catch (const StatusError& error) {
  return error.status();
}

}  // namespace relmap::storage
