// What is done for each keyframe beside the worker, on a view: recognise the place, verify it by geometry, find
// re-observations. The outcome is journal records; the map itself is not touched.
#pragma once

#include <optional>
#include <vector>

#include "server/place/picture_cache.h"
#include "server/place/place_index.h"
#include "server/place/verify.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

// Frames of a session from `first_recent()` on are too near to the query in its own past to be a recognition: within
// 20 odometry edges or 10 s; in a mono session, which has no edges, within 20 consecutive frames (docs/method.md, 7).
// More than 1,000 edges back nothing is, whatever the clock says.
inline constexpr std::uint32_t kRecentEdges = 20;
inline constexpr std::uint32_t kMaxRecentEdges = 1000;
inline constexpr std::int64_t kRecentMicroseconds = 10'000'000;
std::uint32_t first_recent(const storage::Graph& graph, FrameId query);

// A keyframe whose picture fits another camera than its session's, or than that of the session whose place it shows.
struct CameraContradiction {
  SessionNumber with = 0;  // the session whose place it shows
  Status what;             // WRONG_CALIBRATION, with what would fit
};

struct Lookup {
  std::vector<storage::JournalRecord> records;
  std::optional<CameraContradiction> contradiction;  // then there are no records
};

// A function of the view, the index and the frame; `pictures` spares it some decoding. Nothing for a frame of a mono
// session: what it recognises comes without metres, and would be no edge (Map.MatchImage tells).
Lookup look_up(const storage::Graph& view, const place::PlaceIndex& places, place::PictureCache& pictures,
               FrameId frame);

// verify_place() of what `frame` saw, with a seed of its own.
Result<place::VerifiedPlace> verify_frame(const storage::Graph& view, const place::QueryPicture& query, FrameId frame,
                                          FrameId match);

// The proposal that comes of a place where geometry found `frame`: refined where an older view of the same place is
// verified, too, with all that is seen again there. `query`: what the frame saw. Its appearance has not been asked:
// its probability is the caller's to set. To what is known of its uniqueness is added what landmarks tell.
storage::ClosureProposalRecord proposal_of(const storage::Graph& view, place::PictureCache& pictures,
                                           const place::QueryPicture& query, FrameId frame, place::VerifiedPlace found,
                                           const storage::Uniqueness& uniqueness, std::uint32_t recent);

}  // namespace relmap::map
