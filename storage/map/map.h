// The map: what the worker edits, what readers see, and how both stay on disk.
//
// One thread, the map worker, edits the Map: it takes copies of frame parts (edit_*), changes them, and publishes a new
// MapView by one pointer swap. Any number of threads read views; a view is one consistent map for as long as it is held
// and never waits for the worker. commit() writes what is dirty in one atomic batch with the journal sequence it
// contains. The state in memory equals what a reload gives, bit for bit.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/graph/editable_graph.h"
#include "storage/graph/map_state.h"
#include "storage/memory/budget.h"

namespace relmap::storage {

class MapView;

class Map final : public EditableGraph {
 public:
  // Loads sessions and state; frames stay on disk. The journal from applied_sequence + 1 on is the caller's to
  // re-apply.
  static Result<std::unique_ptr<Map>> open(std::shared_ptr<Engine> engine, std::uint64_t epoch,
                                           std::shared_ptr<Budget> budget);
  ~Map() override;

  // Graph, as the worker sees it: its own edits included. Worker only.
  std::shared_ptr<const FrameHot> hot(FrameId id) const override;
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override;
  std::shared_ptr<const FrameCold> cold(FrameId id) const override;
  std::vector<Session> sessions() const override;
  std::optional<Session> session(SessionNumber number) const override;
  void visit_settled(SessionNumber session, std::uint32_t sequence, const SettledVisit& visit) const override;
  std::vector<FrameId> labelled(const std::string& label) const override;
  std::vector<std::string> labels(const std::string& prefix) const override;

  // The copy is dirty, and made at the first edit since the last publish(). The reference is good until the next
  // publish() or commit().
  FrameHot& edit_hot(FrameId id) override;
  FrameWarm& edit_warm(FrameId id) override;
  void add_frame(FrameId id, FrameHot hot, FrameWarm warm, FrameCold cold);

  // Takes the last chunk of a session that is being deleted (SessionState::kDeleting) out of the map, frames, labels
  // and all.
  void remove_last_chunk(SessionNumber number);

  void add_session(Session session);
  Session& edit_session(SessionNumber number);
  // Sequences that end without a frame, behind all that the session settled so: counts them, and moves its next
  // sequence on.
  void settle(SessionNumber number, const Settled& settled);
  // Edits FrameHot::labels and the derived index together.
  void set_label(FrameId id, const std::string& label, bool present);
  MapState& state() override;

  // Makes all edits visible to new readers.
  std::shared_ptr<const MapView> publish();
  // Called by publish() with the chunks in which the hot part of a frame was edited, and the version of the view that
  // shows it, before anyone can have that view. Worker only.
  using EditWatcher = std::function<void(std::uint64_t version, std::span<const ChunkId> chunks)>;
  void watch_edits(EditWatcher watcher);
  // The newest published view. Any thread.
  std::shared_ptr<const MapView> view() const;

  // Publishes, writes everything dirty with state().applied_sequence, and trims the journal. On failure everything
  // stays dirty and can be committed again. Finishes a commit under way before it.
  Status commit();
  // The same beside the worker, which goes on to edit: encodes what is dirty, finishes the commit under way, leaves
  // this one to a thread to write, and returns. `written` is called by that thread when it is done. Not ok: nothing has
  // begun, since the commit before has failed, or a part to be gathered could not be read.
  Status begin_commit(std::function<void()> written);
  // Waits for the commit under way, and says what came of it; nullopt: none was.
  std::optional<Status> finish_commit();
  // Of what no commit under way writes.
  std::size_t dirty_bytes() const;
  // So much is dirty that a commit ought to begin: while one is being written the share has room for more.
  bool commit_is_due() const;

 private:
  struct Impl;
  explicit Map(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// An immutable map version: the engine's snapshot at the last commit, and over it what was dirty at publish().
// Thread-safe.
class MapView final : public Graph {
 public:
  ~MapView() override;
  std::shared_ptr<const FrameHot> hot(FrameId id) const override;
  Slots<FrameHot> hot_frames(ChunkId chunk) const override;
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override;
  std::shared_ptr<const FrameCold> cold(FrameId id) const override;
  std::vector<Session> sessions() const override;
  std::optional<Session> session(SessionNumber number) const override;
  void visit_settled(SessionNumber session, std::uint32_t sequence, const SettledVisit& visit) const override;
  std::vector<FrameId> labelled(const std::string& label) const override;
  std::vector<std::string> labels(const std::string& prefix) const override;

  // The words of every frame that has any and is not `known`, without the descriptors (what the place index has yet to
  // learn at start). Chunks of which all frames are known are not read. DATA_LOSS, IO_ERROR, VIEW_EXPIRED.
  Status scan_words(const std::function<bool(FrameId)>& known,
                    const std::function<void(FrameId, std::span<const std::uint32_t>)>& visit) const;

  std::uint64_t version() const;  // grows with every publish() since the daemon started
  const MapFacts& state() const;
  std::size_t pending_frames() const;  // MapState::pending, their number
  // The last commit, without what was dirty over it: for whoever verifies or copies what stands on disk.
  std::shared_ptr<const EngineSnapshot> committed() const;

  struct Impl;
  explicit MapView(std::unique_ptr<Impl> impl);

 private:
  std::unique_ptr<Impl> impl_;
};

// The map as 64-bit hashes that do not depend on session numbers: structure (frames, tracks, observations, edge states,
// keyed by uuid and sequence), and estimates (every number bit for bit). What tells how a map came about and not what
// it is has no part in them: its identity, epoch and owner, journal sequences, the wall time and the author of edits.
// For tests of recovery and replay, and for backups. A later version of the hash has another number.
inline constexpr int kMapHashVersion = 1;
struct MapHash {
  std::uint64_t structure = 0;
  std::uint64_t estimates = 0;
  bool operator==(const MapHash&) const = default;
};
MapHash hash_map(const Graph& graph);

}  // namespace relmap::storage
