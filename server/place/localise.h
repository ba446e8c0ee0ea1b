// Where in the map was this seen? Appearance proposes places, geometry decides (docs/method.md, 7).
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "proto/keyframe/keyframe.h"
#include "server/place/place_index.h"
#include "server/place/trials.h"
#include "server/place/verify.h"
#include "server/place/vocabulary.h"
#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"

namespace relmap::place {

struct PlaceKnowledge {
  const storage::Graph& graph;
  const PlaceIndex& places;
  const Vocabulary& vocabulary;
};

struct PlaceQuestion {
  std::span<const AppearanceFeature> features;
  std::optional<StereoCamera> camera;           // needed for geometry; f 0: unknown
  std::span<const storage::FrameRange> masked;  // no answers
  std::optional<FrameId> prior;                 // somewhere near it: tried first (localise), or likelier (match)
  bool pair = false;                            // QueryPicture::pair
  CameraKnown known = CameraKnown::kMeasuredWith;
  Vector3 eye_turn = Vector3::Zero();  // QueryPicture::eye_turn

  QueryPicture picture() const { return {features, *camera, masked, pair, known, eye_turn}; }  // with a camera
};

struct Localisation {
  VerifiedPlace place;
  double probability = 0;                 // of the place, by appearance
  double new_place = 1;                   // that the map does not hold what is seen, by appearance
  bool near_prior = false;                // then both are unknown: the map was not searched
  std::uint32_t verified_candidates = 0;  // candidates that geometry was tried on
};

// Around the prior first; the rest of the map only if geometry confirms nothing there (a look-alike elsewhere is not
// asked for then). NO_CALIBRATION, NO_SUCH_FRAME (the prior), EMPTY_MAP, NEW_PLACE, AMBIGUOUS_PLACE, why geometry said
// no (TOO_FEW_FEATURES, TOO_FEW_INLIERS, POOR_SPREAD, WRONG_CALIBRATION), NOT_STEREO (recognised in a mono session: no
// metres), what `proceed` says.
Result<Localisation> localise_features(const PlaceKnowledge& map, const PlaceQuestion& question,
                                       const Proceed& proceed);

struct PlaceMatch {
  FrameId frame;
  double probability = 0;
  // Where geometry was tried and agreed.
  std::optional<VerifiedPlace> verified;
  // Where geometry agreed, and another place explains the picture as well, or better.
  std::optional<VerifiedPlace> doubted;
  // Why it is not verified: geometry's reasons, NO_CALIBRATION, OUT_OF_REACH (not tried), AMBIGUOUS_PLACE (doubted).
  Status unverified;

  // The frame where geometry agreed, or the most probable one.
  FrameId shown() const { return verified ? verified->match : doubted ? doubted->match : frame; }
};

struct PlaceMatches {
  // Verified ones first, then doubted ones, by inliers; the others descending by probability.
  std::vector<PlaceMatch> places;
  double new_place = 1;
  Status nothing_verified;  // why: NEW_PLACE, AMBIGUOUS_PLACE, what geometry said of the best
};

// Every candidate of appearance with its probability, a frame once, the most probable `verify` of them with what
// geometry says (none without a camera), and those that it confirms before the others: what it says of one picture
// against another is worth more than which words they share. Frames of one place only are verified: where another place
// explains the picture about as well, none is. EMPTY_MAP, TOO_FEW_FEATURES, what `proceed` says.
Result<PlaceMatches> match_features(const PlaceKnowledge& map, const PlaceQuestion& question, std::size_t verify,
                                    const Proceed& proceed);

}  // namespace relmap::place
