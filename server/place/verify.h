// Is this picture really of that place? Geometry decides (docs/method.md, 7).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "proto/geometry/camera.h"
#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::place {

// Whose word a camera is. Unless the session that saw the place was measured with it, it is taken to be right within
// what calibrations are: estimate_tolerant_motion().
enum class CameraKnown : std::uint8_t {
  kMeasuredWith,  // a session's own, of a frame of the map
  kNamed,         // by whoever asks
  kSupposed,      // by nobody: it may be another camera than the session's, whatever its numbers are
};

struct QueryPicture {
  std::span<const AppearanceFeature> features;  // rectified; disparities where the query is stereo
  // Baseline 0: mono. f 0: nothing but the picture's size is known, and the lens is estimated with the pose.
  StereoCamera camera;
  std::span<const storage::FrameRange> masked = {};  // no answers: the query's own recent past
  // It is said to be what both eyes saw at one time: then most of what is recognised must have a disparity.
  bool pair = false;
  CameraKnown known = CameraKnown::kMeasuredWith;
  // The picture is as likely as not the right eye's, taken for the left one's: then it is turned by this rotation
  // (vector, radians), which the covariance of the pose allows for. Zero: it is known whose it is.
  Vector3 eye_turn = Vector3::Zero();
};

inline constexpr std::uint32_t kViewReach = 3;  // steps along the odometry, both ways
inline constexpr int kMinInliers = 20;
inline constexpr double kMinSpread = 0.05;  // share of the picture's area that the inliers' cells cover

struct VerifiedPlace {
  FrameId match;
  SE3 T_match_query;
  Matrix6 covariance = Matrix6::Zero();
  storage::Verification verification = storage::Verification::kStereo;
  bool homography = false;  // where the verification is kEpipolar: of one plane, no fundamental matrix
  std::uint32_t inliers = 0;
  std::vector<std::uint32_t> features;  // the inliers: of the query, ascending
  double spread = 0;
  double focal_length = 0;                         // pixels: the query's, or the estimate
  std::vector<storage::ProposedBinding> bindings;  // inliers whose map side is a landmark
};

// Matches the query against the features and landmarks of `candidate` and the frames up to kViewReach steps along its
// session's odometry, expressed in the frame that saw most of what fits: `match`, the candidate itself as a rule.
// NO_SUCH_FRAME, TOO_FEW_FEATURES, TOO_FEW_INLIERS (of an unknown lens twice as many are needed), POOR_SPREAD,
// NO_CALIBRATION (an unknown focal length that what is seen does not tell), WRONG_CALIBRATION (check_camera(): the
// place is recognised, and the pose would be wrong), NOT_STEREO (a pair that is none). `seed` fixes RANSAC. A candidate
// of a mono session is verified by fundamental matrices or homographies between the query and it and the frames beside
// it, with which 16 features each and 30 together agree; `match` is the frame with which most do. T_match_query is the
// identity with a covariance that says nothing, and there are no bindings.
Result<VerifiedPlace> verify_place(const storage::Graph& graph, const QueryPicture& query, FrameId candidate,
                                   std::uint64_t seed);

// The same, and what fits there where it is too little to be confirmed: that may be as much as fits anywhere.
struct PlaceTrial {
  FrameId frame;                        // `match`, or the candidate
  std::vector<std::uint32_t> features;  // that fit: of the query, ascending
  Result<VerifiedPlace> verified;
};
PlaceTrial try_place(const storage::Graph& graph, const QueryPicture& query, FrameId candidate, std::uint64_t seed);

// Whether geometry found the place and says that the picture is not of the camera that is named for it, or no pair
// (WRONG_CALIBRATION, NOT_STEREO).
bool is_contradicted(const PlaceTrial& trial);

// With so many inliers the check of the camera tells: who passes it is of that camera.
inline constexpr std::size_t kSureInliers = 2 * kMinInliers;

// The contradicted one of the trials of one picture with most features, if more fit there than anywhere that is
// confirmed, and kSureInliers nowhere: too little fits elsewhere to tell the same, and the pose there is as wrong. Else
// it is the contradicted place whose camera is another one. Null otherwise.
const PlaceTrial* contradiction(std::span<const PlaceTrial> trials);

// Re-observations in `frame` of landmarks from around `match`, given where the frame is: landmarks are projected,
// matched by descriptor inside the gate of the transform's covariance. `first_maskable` and newer frames of the frame's
// own session are left out (they are tracked already).
std::vector<storage::ProposedBinding> propose_bindings(const storage::Graph& graph, const QueryPicture& query,
                                                       FrameId frame, FrameId match, const SE3& T_match_frame,
                                                       const Matrix6& covariance, std::uint32_t first_maskable);

}  // namespace relmap::place
