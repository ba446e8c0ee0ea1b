// Reads the skeleton of a map, page by page: chains of points, and closures between them.
//
// Beside the points that a level asks for (level.h), points are the ends of sessions, of stretches that are a guess or
// along which the robot was carried, and of the closures that are told. So nothing joins a chain but at a point. Which
// frames are the older ends of closures is not known before all closures have been read, so the reader first runs over
// these.
//
// Sessions without metric scale (of one camera) have no motion, and are left out.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/base/status.h"
#include "server/skeleton/chain_points.h"
#include "server/skeleton/closure_choice.h"
#include "storage/map/map.h"

namespace relmap::skeleton {

struct SkeletonOptions {
  std::uint32_t level = 1;                   // 0 to 3
  std::vector<SessionNumber> sessions = {};  // empty: all
  bool candidates = false;                   // also closures that are not in force
  std::size_t page_bytes = 256u << 10;       // of a message, about
};

struct Closure {
  storage::ClosureDigest digest;
  float suspicion = 0;
  std::uint32_t alike = 1;
};

// What was told through the end of a page.
struct Position {
  FrameId last;                   // the last frame
  std::uint64_t frames_done = 0;  // of frames_total()
  std::string to_string() const;  // without spaces
  static std::optional<Position> parse(const std::string& text);
};

struct Page {
  std::vector<Chain> chains;  // a chain that goes on in the next page begins there with a copy of its last point
  std::vector<Closure> closures;
  Position end;
};

// Called now and then with the bytes that the reader holds. A status other than OK ends the reading.
using Proceed = std::function<Status(std::size_t bytes)>;

// Not thread-safe.
class SkeletonReader {
 public:
  // INVALID_ARGUMENT: no such level. NO_SUCH_SESSION, SESSION_DELETED; NOT_STEREO if a session of one camera is chosen.
  static Result<std::unique_ptr<SkeletonReader>> open(std::shared_ptr<const storage::MapView> view,
                                                      SkeletonOptions options, Suspicion suspicion, Proceed proceed);
  // Goes on behind what was told before, by another reader with the same view and options.
  void resume(const Position& position) { position_ = position; }

  // The next page; nullopt after the last. Of a map without frames there is none. VIEW_EXPIRED, DATA_LOSS, IO_ERROR,
  // and the status of `proceed`.
  Result<std::optional<Page>> next();

  std::uint64_t frames_total() const { return frames_total_; }

 private:
  SkeletonReader(std::shared_ptr<const storage::MapView> view, SkeletonOptions options, Suspicion suspicion,
                 Proceed proceed);
  Status choose_sessions();
  bool is_chosen(SessionNumber session) const;
  std::vector<ChosenClosure> chosen_of(const storage::ChunkDigest& chunk) const;
  Status find_older_ends();
  Status visit(storage::ChunkId from, storage::DigestsOf which,
               const std::function<bool(const storage::ChunkDigest&)>& visit);
  std::uint64_t kept_in(const storage::ChunkDigest& chunk, const std::vector<ChosenClosure>& closures) const;

  const std::shared_ptr<const storage::MapView> view_;
  const SkeletonOptions options_;
  const Suspicion suspicion_;
  const Proceed proceed_;
  std::vector<SessionNumber> sessions_;  // ascending: those that are told
  std::uint64_t frames_total_ = 0;
  bool ends_known_ = false;
  std::vector<FrameId> older_ends_;  // ascending
  ChainContraction contraction_;
  std::optional<Position> position_;
  bool done_ = false;
};

}  // namespace relmap::skeleton
