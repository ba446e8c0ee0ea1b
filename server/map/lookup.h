// The lookup of a keyframe, made on a view beside the worker: recognises the place, verifies it by geometry and finds
// re-observations. The outcome is journal records; the map itself is not changed.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "server/map/way_around.h"
#include "server/place/picture_cache.h"
#include "server/place/place_index.h"
#include "server/place/verify.h"
#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

// Index of the query's oldest recent frame. It and later frames of the session are too near to the query in its own
// past to count as recognition. Recent is within 20 odometry edges or within 10 s, but at most 1,000 edges. Where the
// robot stood still counts for neither: what it sees before and after a stop is one view of one place, which may be the
// cabin of a lift that carries it. In a mono session, which has no edges, consecutive frames count instead
// (docs/method.md, 7).
inline constexpr std::uint32_t kRecentEdges = 20;
inline constexpr std::uint32_t kMaxRecentEdges = 1000;
inline constexpr std::int64_t kRecentMicroseconds = 10'000'000;
std::uint32_t first_recent(const storage::Graph& graph, FrameId query);
// The query's oldest recent frame and all later ones of its session: they are no answers to what the query shows.
storage::FrameRange recent_past(const storage::Graph& graph, FrameId query);

// A keyframe that shows a place but fits another calibration: its session's camera, or that of the place's session, is
// not as calibrated.
struct CameraContradiction {
  SessionNumber with = 0;  // the session whose place it shows
  Status what;             // WRONG_CALIBRATION, with what would fit
};

struct Lookup {
  std::vector<storage::JournalRecord> records;
  std::optional<CameraContradiction> contradiction;  // then there are no records
};

// Tells the frames of other sessions that have come into the map after the one that is looked up, until it is called.
using LaterFrames = std::function<std::vector<storage::FrameRange>()>;

// Looks up a frame: a function of the view, the index and the frame, with `pictures` as cache of decoded pictures.
// Returns nothing for a frame of a mono session, since its closures would have no metres and could not be edges
// (Map.MatchImage tells what such a frame recognises).
// What is `later` is left out of the question to the index, where it would count as a part of the known world, and what
// the map took in later of the answers: of two frames that show one place, the later finds the earlier. Ways around
// stops are sought in the newest map if `newest` is given, and otherwise in the view.
Lookup look_up(const storage::Graph& view, const place::PlaceIndex& places, place::PictureCache& pictures,
               FrameId frame, const LaterFrames& later = {}, const RouteMap& newest = {});

// try_place() for what `frame` saw, with a random seed that depends on the frame alone.
place::PlaceTrial try_frame(const storage::Graph& view, const place::QueryPicture& query, FrameId frame, FrameId match);
// What it verifies.
Result<place::VerifiedPlace> verify_frame(const storage::Graph& view, const place::QueryPicture& query, FrameId frame,
                                          FrameId match);

// Makes a proposal of a place that geometry verified for `frame`. If an older view of the place verifies too, the
// closure is made with that view. Bindings of everything seen again are added. `query` is what the frame saw; frames of
// its session from `recent` on do not count. If `uniqueness` is known, changes of old landmarks are added to it. The
// caller sets `probability`, which appearance tells.
storage::ClosureProposalRecord proposal_of(const storage::Graph& view, place::PictureCache& pictures,
                                           const place::QueryPicture& query, FrameId frame, place::VerifiedPlace found,
                                           const storage::Uniqueness& uniqueness, std::uint32_t recent);

}  // namespace relmap::map
