// A piece of a graph that is imported: frames of one session, without pictures and landmarks, and loops between them.
// It is checked before anything of it is written.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "proto/keyframe/keyframe.h"
#include "server/map/mapper.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

// Collects a piece, whose parts are checked one by one as they are added. A refusal names the frame or loop.
class GraphPiece {
 public:
  // A piece of `frames` frames from index `first` of the session on. INVALID_ARGUMENT if an index is too large for a
  // frame.
  static Result<GraphPiece> make(SessionHeader header, std::uint32_t first, std::uint32_t frames);

  const SessionHeader& header() const { return header_; }
  // The index of the frame that add_frame() takes next. Not to be asked after fit().
  std::uint32_t next_index() const { return first_ + static_cast<std::uint32_t>(frames_.size()); }

  // Adds the next frame, and sets its session and sequence; must be called before fit(). The reasons of
  // check_keyframe(), and BAD_DURATION (it is no later than the one before).
  Status add_frame(Keyframe keyframe);
  // Adds a loop from frame `query` back to `match`, whose session numbers are set by begin().
  void add_loop(storage::ClosureProposalRecord loop) { loops_.push_back(std::move(loop)); }

  // Checks that the piece continues what `map` holds of the session, and drops the frames that it holds already.
  // NO_SUCH_FRAME (frames before the piece, or the later end of a loop, are missing), TIME_BACKWARDS (the first new
  // frame is no later than the last one of the map). Other pieces must not be written before begin().
  Status fit(const storage::Graph& map);

  // Begins the session if it is new, and returns its number. The reasons are those of Mapper::begin_session().
  Result<SessionNumber> begin(Mapper& mapper);

  // Writes the frames and the loops to the journal after begin(), and waits until they are applied, since the next
  // piece is checked against them. Returns the sequence of the last record; 0 if there was none to write. While the
  // journal's queue is full, and until the records are durable, `proceed` is called again and again; a status of it
  // that is not ok ends the wait. Other reasons are those of Mapper::submit() and Mapper::wait_applied(). What has been
  // written by then stays.
  Result<std::uint64_t> write(Mapper& mapper, std::chrono::steady_clock::time_point deadline,
                              const std::function<Status()>& proceed) const;

  const std::vector<Keyframe>& frames() const { return frames_; }

 private:
  GraphPiece(SessionHeader header, std::uint32_t first) : header_(std::move(header)), first_(first) {}

  SessionHeader header_;
  std::uint32_t first_ = 0;
  SessionNumber session_ = 0;  // set by begin()
  std::vector<Keyframe> frames_;
  std::vector<storage::ClosureProposalRecord> loops_;
};

// The ends of an imported loop: INVALID_ARGUMENT unless `query` is the later frame.
Status check_loop_ends(std::uint32_t query, std::uint32_t match);
// The transform of an imported loop: BAD_MOTION if its ends are more than 10,000 km apart.
Status check_loop_motion(const SE3& T_match_query);

}  // namespace relmap::map
