// Localises a picture in the map: appearance proposes places, geometry verifies them (docs/method.md, 7).
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
  std::optional<StereoCamera> camera;           // geometry needs one; f is 0 where unknown
  std::span<const storage::FrameRange> masked;  // frames that are no answers
  // A frame near which the picture is thought to be taken: localise_features() tries the frames around it first,
  // match_features() takes them to be likelier.
  std::optional<FrameId> prior;
  bool pair = false;  // QueryPicture::pair
  CameraKnown known = CameraKnown::kMeasuredWith;
  Vector3 eye_turn = Vector3::Zero();  // QueryPicture::eye_turn
  bool keep_matches = false;           // QueryPicture::keep_matches

  QueryPicture picture() const {
    return {features, *camera, masked,   {},          {std::numeric_limits<std::uint64_t>::max()},
            pair,     known,   eye_turn, keep_matches};
  }  // needs a camera
};

struct Localisation {
  VerifiedPlace place;
  double probability = 0;                 // of the place, by appearance
  double new_place = 1;                   // probability, by appearance, that the map does not hold the place
  bool near_prior = false;                // found around the prior; both probabilities are unknown then
  std::uint32_t verified_candidates = 0;  // candidates on which geometry was tried
  std::vector<PointMatch> matches = {};   // PlaceTrial::matches, if they are kept; in pixels of place.match
};

// Returns the pose of the question's picture. Tries the frames around the prior first, and the rest of the map only if
// geometry confirms none of them; a place found around the prior is not compared with look-alikes elsewhere.
//
// NO_CALIBRATION (no camera, an unknown lens that cannot be estimated, or a mirrored picture), NO_SUCH_FRAME (the
// prior), EMPTY_MAP, NEW_PLACE, AMBIGUOUS_PLACE, NOT_STEREO (recognised in a mono session, which has no metres, or a
// pair that is none), geometry's refusals (TOO_FEW_FEATURES, TOO_FEW_INLIERS, POOR_SPREAD, WRONG_CALIBRATION), and what
// `proceed` returns.
Result<Localisation> localise_features(const PlaceKnowledge& map, const PlaceQuestion& question,
                                       const Proceed& proceed);

struct PlaceMatch {
  FrameId frame;
  double probability = 0;
  // Set if geometry confirms the place.
  std::optional<VerifiedPlace> verified;
  // Set if geometry confirms the place but another one explains the picture as well or better.
  std::optional<VerifiedPlace> doubted;
  // Why the place is not verified: geometry's refusals, NO_CALIBRATION, OUT_OF_REACH (geometry was not tried),
  // AMBIGUOUS_PLACE (doubted).
  Status unverified;
  // PlaceTrial::matches, if they are kept, in pixels of shown(); none if geometry was not tried.
  std::vector<PointMatch> matches = {};

  // The frame in which geometry confirmed the place, or else the most probable frame of the place.
  FrameId shown() const { return verified ? verified->match : doubted ? doubted->match : frame; }
};

struct PlaceMatches {
  // Verified places first, then doubted ones, each descending by inliers; then the others, descending by probability.
  std::vector<PlaceMatch> places;
  double new_place = 1;     // probability, by appearance, that the map does not hold the place
  Status nothing_verified;  // why no place is verified: NEW_PLACE, AMBIGUOUS_PLACE, geometry's refusal of the best
};

// Returns every candidate of appearance with its probability, each frame once, and tries geometry on the `max_verified`
// most probable ones (on none without a camera). Candidates that geometry confirms come first, since geometry is the
// better evidence. Only frames of one place are reported as verified, and none if another place explains the picture
// about as well. EMPTY_MAP, TOO_FEW_FEATURES, and what `proceed` returns.
Result<PlaceMatches> match_features(const PlaceKnowledge& map, const PlaceQuestion& question, std::size_t max_verified,
                                    const Proceed& proceed);

}  // namespace relmap::place
