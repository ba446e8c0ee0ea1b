// The map: what the worker edits, what readers see, and how both stay on disk.
//
// One thread, the map worker, edits the Map: it takes copies of frame parts (edit_*), changes them, and publishes a new
// MapView by one pointer swap. Any number of threads read views; a view is one consistent map for as long as it is held
// and never waits for the worker. commit() writes what is dirty in one atomic batch with the journal sequence it
// contains. The state in memory equals what a reload gives, bit for bit.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/events/event_log.h"
#include "storage/graph/digest.h"
#include "storage/graph/editable_graph.h"
#include "storage/graph/map_state.h"
#include "storage/memory/budget.h"

namespace relmap::storage {

class MapView;

class Map final : public EditableGraph {
 public:
  // Loads the state, and reads all sessions once; they and the frames stay on disk. The caller has to apply the journal
  // again from applied_sequence + 1 on.
  // `events` limits the log of events.
  static Result<std::unique_ptr<Map>> open(std::shared_ptr<Engine> engine, std::uint64_t epoch,
                                           std::shared_ptr<Budget> budget, EventLimits events = {});
  ~Map() override;

  // The graph as the worker sees it, with its own edits. Worker only.
  std::shared_ptr<const FrameHot> hot(FrameId id) const override;
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override;
  std::shared_ptr<const FrameCold> cold(FrameId id) const override;
  void visit_sessions(SessionNumber from, const SessionVisit& visit) const override;
  std::optional<Session> session(SessionNumber number) const override;
  void visit_skipped(SessionNumber session, std::uint32_t sequence, const SkippedVisit& visit) const override;
  std::vector<FrameId> labelled(const std::string& label) const override;
  std::vector<std::string> labels(const std::string& prefix) const override;

  // Return the worker's copy of a frame's part, which is made at the first edit since the last publish() and is dirty.
  // The reference is valid until the next publish() or commit().
  FrameHot& edit_hot(FrameId id) override;
  FrameWarm& edit_warm(FrameId id) override;
  void add_frame(FrameId id, FrameHot hot, FrameWarm warm, FrameCold cold);

  // Removes the last chunk of a session that is being deleted (SessionState::kDeleting) from the map, with its frames
  // and their labels.
  void remove_last_chunk(SessionNumber number);

  void add_session(Session session);
  Session& edit_session(SessionNumber number);
  // Records sequences as skipped, counts them, and moves the session's next sequence on. They must lie behind all that
  // the session has skipped so far. Of a session that is being deleted, nothing is recorded.
  void skip(SessionNumber number, const Skipped& skipped);
  // Removes `most` records, or all that there are, of what a session that is being deleted has skipped, from the end of
  // its frames on, and counts them no more.
  void forget_skipped(SessionNumber number, std::size_t most);
  // Edits FrameHot::labels and the derived index together.
  void set_label(FrameId id, const std::string& label, bool present);
  MapState& state() override;
  // Remembers the edit that was record `sequence` of the journal by its key, and forgets the oldest beyond
  // kRememberedEdits.
  void remember_edit(std::uint64_t sequence, EditKey edit);
  // Those remembered, by sequence.
  const std::map<std::uint64_t, EditKey>& edits() const;

  // Adds to the log of events, in the next commit. Events ascend by position.
  void record(const Event& event);
  // Relaxation changed the edge that is stored with the frame: the next commit tells that it moved.
  void note_moved(FrameId frame);

  // Makes all edits visible to new readers, and returns the new view.
  std::shared_ptr<const MapView> publish();
  // publish() calls the watcher with the chunks in which the hot part of a frame was edited, and with the version of
  // the view that shows the edits, before anyone can have that view. Worker only.
  using EditWatcher = std::function<void(std::uint64_t version, std::span<const ChunkId> chunks)>;
  void watch_edits(EditWatcher watcher);
  // The newest published view. Any thread.
  std::shared_ptr<const MapView> view() const;
  // Once the session's record was read or edited, views find it in memory as long as the result lives. Any thread.
  std::shared_ptr<const void> hold_session(SessionNumber number) const;

  // Publishes, writes everything that is dirty and what was recorded together with state().applied_sequence, and trims
  // the journal. If it fails, everything stays dirty and can be committed again. A commit under way is finished first.
  Status commit();
  // Begins a commit that is written while the worker goes on editing: encodes what is dirty, finishes the commit under
  // way, lets a thread write this one, and returns. That thread calls `written` when it is done. If the result is not
  // OK, nothing has begun: the commit before has failed, or a part that had to be gathered could not be read.
  Status begin_commit(std::function<void()> written);
  // Waits for the commit under way and returns its outcome; nullopt if there was none.
  std::optional<Status> finish_commit();
  // Whether the digests on disk (storage/graph/digest.h) are right, so that commits keep them up and views read them.
  // They are not in a map that a program without digests wrote to last: views then make them from the frames.
  bool digests_hold() const;
  // Called after each chunk with the frames done and the frames of the map; false: stop.
  using DigestProgress = std::function<bool(std::uint64_t done, std::uint64_t total)>;
  // Makes the digests of all that is committed anew, in commits of their own and little memory. A frame that cannot be
  // read gets none. SHUTTING_DOWN if stopped. Worker only.
  Status rebuild_digests(const DigestProgress& progress);
  // The same, but goes on where that was stopped, or failed, if the map has not been committed since. Those that were
  // made before count as done.
  Status complete_digests(const DigestProgress& progress);

  // Bytes that are dirty, without those that a commit under way is writing.
  std::size_t dirty_bytes() const;
  // Whether so much is dirty that a commit ought to begin. The share still has room for what is edited while it is
  // written.
  bool commit_is_due() const;

 private:
  struct Impl;
  explicit Map(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// An immutable version of the map: the engine's snapshot of the last commit, and on top of it what was dirty at
// publish().
class MapView final : public Graph {
 public:
  ~MapView() override;
  std::shared_ptr<const FrameHot> hot(FrameId id) const override;
  Slots<FrameHot> hot_frames(ChunkId chunk) const override;
  std::shared_ptr<const FrameWarm> warm(FrameId id) const override;
  std::shared_ptr<const FrameCold> cold(FrameId id) const override;
  void visit_sessions(SessionNumber from, const SessionVisit& visit) const override;
  SessionCounts session_counts() const override;  // without reading any
  std::optional<Session> session(SessionNumber number) const override;
  void visit_skipped(SessionNumber session, std::uint32_t sequence, const SkippedVisit& visit) const override;
  std::vector<FrameId> labelled(const std::string& label) const override;
  std::vector<std::string> labels(const std::string& prefix) const override;

  // Visits the words of every frame that has any and is not `known`, without reading the descriptors: what the place
  // index has yet to learn at start. Chunks of which all frames are known are not read. DATA_LOSS, IO_ERROR,
  // VIEW_EXPIRED.
  Status scan_words(const std::function<bool(FrameId)>& known,
                    const std::function<void(FrameId, std::span<const std::uint32_t>)>& visit) const;

  // Visits the digests of all chunks that have frames (with `kClosures`: frames with closures, and only these), from
  // `from` on, ascending, until `visit` returns false: of this version of the map, as precise as they are stored
  // (storage/format/digest_codec.h), whether they are committed or not. One scan, without the cache. DATA_LOSS naming a
  // chunk whose record is damaged, IO_ERROR, VIEW_EXPIRED. What `visit` throws passes through, but for a StatusError,
  // which is returned.
  Status visit_digests(ChunkId from, const std::function<bool(const ChunkDigest&)>& visit,
                       DigestsOf which = DigestsOf::kAll) const;

  std::uint64_t version() const;  // grows with every publish() since the daemon started
  // Whether the view was cut off, since old views hold more memory than their share: its reads throw VIEW_EXPIRED. Its
  // memory is freed when its last owner lets it go.
  bool expired() const;
  const MapFacts& state() const;
  std::size_t pending_frames() const;  // number of frames in MapState::pending
  // The last commit, without what was dirty on top of it: for verifying or copying what stands on disk.
  std::shared_ptr<const EngineSnapshot> committed() const;

  struct Impl;
  explicit MapView(std::unique_ptr<Impl> impl);

 private:
  std::unique_ptr<Impl> impl_;
};

// The map as two 64-bit hashes that do not depend on session numbers: structure (frames, tracks, observations, edge
// states, keyed by uuid and sequence) and estimates (every number bit for bit). What says how a map came about and not
// what it is has no part in them: its identity, epoch and owner, journal sequences, the wall time and the author of
// edits. For tests of recovery and replay, and for backups. A later version of the hash gets another number.
inline constexpr int kMapHashVersion = 1;
struct MapHash {
  std::uint64_t structure = 0;
  std::uint64_t estimates = 0;
  bool operator==(const MapHash&) const = default;
};
MapHash hash_map(const Graph& graph);

}  // namespace relmap::storage
