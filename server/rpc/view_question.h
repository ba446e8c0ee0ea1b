// Converts relmap.v1.View to the features and camera that localise.h needs. Internal to server/rpc, since it exposes
// generated code.
#pragma once

#include <optional>
#include <vector>

#include "proto/geometry/camera.h"
#include "proto/keyframe/keyframe.h"
#include "relmap/v1/common.pb.h"
#include "server/place/picture_query.h"
#include "server/place/verify.h"
#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"

namespace relmap::rpc {

struct SeenView {
  std::vector<AppearanceFeature> features;
  std::optional<StereoCamera> camera;       // f is 0 if unknown; nullopt if not even the size is known
  double scale = 1;                         // pixels of `camera` per pixel of the given picture
  std::vector<storage::FrameRange> masked;  // frames that are no answers: the recent past if the view is a map frame
  bool pair = false;                        // both pictures of a pair were given, and the right one shows something
  place::CameraKnown known = place::CameraKnown::kMeasuredWith;
  Vector3 eye_turn = Vector3::Zero();  // QueryPicture::eye_turn
  place::SentPixels sent = {};         // turns pixels of `camera` into those of the given picture
};

// Decodes and describes pictures, and checks features. INVALID_ARGUMENT (an empty view, a frame with a camera, options
// that do not fit), NO_CALIBRATION (the session has no camera), NO_SUCH_SESSION, SESSION_DELETED, NO_SUCH_FRAME, and
// the reasons of place::camera_of_session(), place::describe_picture() and from_wire().
Result<SeenView> see(const v1::View& view, const storage::Graph& graph);

// The view without its camera, nor what can only be said of pictures of a session's camera: see() takes it for one of
// an unknown camera.
v1::View without_camera(v1::View view);

}  // namespace relmap::rpc
