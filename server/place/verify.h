// Verifies by geometry that a picture shows a place (docs/method.md, 7).
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "proto/geometry/camera.h"
#include "server/place/point_match.h"
#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::place {

// How the camera of a query is known. Unless it is the camera of a session, its calibration is taken to be right only
// within the usual errors of calibrations (estimate_tolerant_motion()).
enum class CameraKnown : std::uint8_t {
  kMeasuredWith,  // the camera of the session in the map to which the picture belongs
  kNamed,         // named by the caller
  kSupposed,      // only supposed: the picture may be of another camera, even one with the same numbers
};

struct QueryPicture {
  std::span<const AppearanceFeature> features;  // rectified; with disparities if the query is stereo
  // Baseline 0: mono. f 0: only the picture's size is known, and the lens is estimated with the pose.
  StereoCamera camera;
  std::span<const storage::FrameRange> masked = {};  // frames that are no answers, such as the query's own recent past
  std::span<const std::uint32_t> words = {};         // of the features, one each; empty: not known
  // Nor are frames that the map took in later. The default is for a picture that is not in the map.
  storage::TakenIn taken_in = {std::numeric_limits<std::uint64_t>::max()};
  // Whether the picture is said to be one of a stereo pair; enough of what is recognised must then have a disparity.
  bool pair = false;
  CameraKnown known = CameraKnown::kMeasuredWith;
  // Not zero if the picture, taken for the left eye's, may as likely be the right eye's: the rotation between the eyes
  // (rotation vector, radians), for which the covariance of the pose allows.
  Vector3 eye_turn = Vector3::Zero();
  bool keep_matches = false;  // PlaceTrial::matches are wanted, for people to look at
};

// The question with what a frame of the map saw.
QueryPicture query_of(const storage::FrameCold& cold, const StereoCamera& camera);

// Whether the frame may answer the query: it is neither masked nor later than the query, nor unknown to the graph.
bool may_answer(const storage::Graph& graph, const QueryPicture& query, FrameId frame);

inline constexpr std::uint32_t kViewReach = 3;  // steps along the odometry, in both directions
inline constexpr int kMinInliers = 20;
inline constexpr double kMinSpread = 0.05;  // share of the picture's cells in which inliers lie

struct VerifiedPlace {
  FrameId match;
  SE3 T_match_query;
  Matrix6 covariance = Matrix6::Zero();  // of T_match_query Exp(xi)
  storage::Verification verification = storage::Verification::kStereo;
  bool homography = false;  // for kEpipolar: whether a homography was fitted rather than a fundamental matrix
  std::uint32_t inliers = 0;
  std::vector<std::uint32_t> features;             // the inliers, as features of the query, ascending
  double spread = 0;                               // share of the picture's cells in which inliers lie (spread.h)
  double focal_length = 0;                         // pixels; the query's, or its estimate
  std::vector<storage::ProposedBinding> bindings;  // inliers that are matched to landmarks
};

// Verifies that the query shows `candidate`, and estimates its pose from the features and landmarks of the frames up to
// kViewReach steps along the candidate's odometry. The pose is relative to `match`, the frame that saw most of the
// inliers, which is the candidate as a rule. `seed` makes RANSAC deterministic.
//
// A candidate of a mono session is verified by fundamental matrices or homographies between the query and the candidate
// and the frames beside it: at least 16 features must agree with each, and 30 in total. `match` is then the frame with
// the most inliers, T_match_query is the identity with a meaningless, huge covariance, and there are no bindings.
//
// NO_SUCH_FRAME, TOO_FEW_FEATURES, TOO_FEW_INLIERS (an unknown lens needs twice as many), POOR_SPREAD, NO_CALIBRATION
// (an unknown focal length cannot be estimated from what is seen), WRONG_CALIBRATION (check_camera(): the place is
// recognised, but the pose would be wrong), NOT_STEREO (the two pictures of a pair do not belong together).
Result<VerifiedPlace> verify_place(const storage::Graph& graph, const QueryPicture& query, FrameId candidate,
                                   std::uint64_t seed);

// The result of verify_place(), and the features that fit even if the place is refused.
struct PlaceTrial {
  FrameId frame;                        // `match`, or the candidate
  std::vector<std::uint32_t> features;  // features of the query that fit, ascending
  Result<VerifiedPlace> verified;
  // With QueryPicture::keep_matches: what was matched, the inliers first, in pixels of the verified frame or, if the
  // place is refused, of the candidate. Then the inliers are those that agreed with the best transform, if any. Points
  // behind the camera of that frame, which only frames beside it saw, are left out.
  std::vector<PointMatch> matches = {};
};
PlaceTrial try_place(const storage::Graph& graph, const QueryPicture& query, FrameId candidate, std::uint64_t seed);

// Whether geometry recognised the place but found that the picture is not of the named camera (WRONG_CALIBRATION) or
// that the pair is none (NOT_STEREO).
bool is_contradicted(const PlaceTrial& trial);

// With so many inliers the check of the camera is conclusive: a picture that passes it is of that camera.
inline constexpr std::size_t kSureInliers = 2 * kMinInliers;

// Given the trials of one picture, returns the contradicted trial with the most features if the query's camera must be
// wrong: more features fit there than at any confirmed place, and no confirmed place has kSureInliers, so the check of
// the camera was not conclusive there. Null otherwise: then it is the camera of the contradicted place that is wrong.
const PlaceTrial* contradiction(std::span<const PlaceTrial> trials);

// Proposes re-observations in `frame` of landmarks seen around `match`, given the pose of the frame: landmarks are
// projected and matched by descriptor inside the gate of the transform's covariance. Frame `first_maskable` of the
// frame's own session and newer ones are left out, since they are tracked already.
std::vector<storage::ProposedBinding> propose_bindings(const storage::Graph& graph, const QueryPicture& query,
                                                       FrameId frame, FrameId match, const SE3& T_match_frame,
                                                       const Matrix6& covariance, std::uint32_t first_maskable);

}  // namespace relmap::place
