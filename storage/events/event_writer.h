// Writes the log of events. Keeps what happened until a commit has written it, and forgets what is old. For the one
// thread that edits the map.
//
// What a commit costs does not depend on how long the log is: as much is deleted as was written, and the oldest block
// tells by its header whether it must go.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "storage/events/event_block.h"
#include "storage/events/event_log.h"
#include "storage/graph/chunk.h"

namespace relmap::storage {

class EventWriter {
 public:
  explicit EventWriter(EventLimits limits) : limits_(limits) {}

  // Goes on behind what the log has. Where the log's head is lost, it is found again from the blocks; where these
  // cannot be read either, the log begins anew behind `applied_sequence`, that of the last commit. IO_ERROR.
  Status open(const EngineSnapshot& snapshot, std::uint64_t applied_sequence);

  // Keeps an event for the next commit. Events ascend.
  void record(const Event& event);
  // Relaxation changed the edge that is stored with the frame. A frame that was added since the commit before is not
  // told.
  void note_moved(FrameId frame);
  // Of what is kept for the next commit.
  std::size_t memory_bytes() const;

  // Adds to a commit what was kept since the last one, and the deletion of what is too old. `snapshot` is of the last
  // commit. What is kept from now on goes to the commit after this.
  void begin_commit(const EngineSnapshot& snapshot, std::uint64_t applied_sequence, std::int64_t now_us,
                    std::vector<Put>& puts, std::vector<std::string>& deletes);
  // The outcome of the commit that was begun. If it failed, what it told is told by the next one; without an outcome,
  // it failed.
  void committed();
  void failed();

  EventLimits limits() const { return limits_; }
  void set_limits(EventLimits limits) { limits_ = limits; }

 private:
  using Frames = std::map<ChunkId, std::uint64_t>;  // a bit by slot
  struct Kept {
    std::vector<EventBlock> blocks;
    std::size_t block_bytes = 0;
    Frames added, moved;
  };
  // The oldest block that stays, and what its header says.
  struct Oldest {
    EventPosition last;
    std::int64_t time_us = 0;
    std::uint64_t bytes_before = 0;  // EventBlockHeader::bytes_through of the block before it
  };

  Status find_head(const EngineSnapshot& snapshot);
  static void add_frame(Frames& frames, FrameId id);
  static std::vector<FrameRange> moved_ranges(const Kept& kept);
  bool is_too_old(const Oldest& oldest, std::int64_t now_us) const;
  void delete_old(const EngineSnapshot& snapshot, std::int64_t now_us, std::size_t most,
                  std::vector<std::string>& deletes);
  static Result<std::optional<Oldest>> first_behind(const EngineSnapshot& snapshot, const std::string& key);

  EventLimits limits_;
  Kept kept_;
  bool has_head_ = false;  // something was told, so that there is a head
  EventLogHead head_;
  std::optional<Oldest> oldest_;  // of the blocks on disk; nullopt: there is none, or it is not known

  // While a commit is under way, what it writes and what holds if it fails.
  struct Begun {
    Kept kept;
    bool had_head = false;
    EventLogHead head;
    std::optional<Oldest> oldest;
  };
  std::optional<Begun> begun_;
};

}  // namespace relmap::storage
