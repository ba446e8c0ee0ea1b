// relmap.v1.View to what localise.h asks: features and a camera. Internal to server/rpc: shows generated code.
#pragma once

#include <optional>
#include <vector>

#include "proto/geometry/camera.h"
#include "proto/keyframe/keyframe.h"
#include "relmap/v1/common.pb.h"
#include "server/place/verify.h"
#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"

namespace relmap::rpc {

struct SeenView {
  std::vector<AppearanceFeature> features;
  std::optional<StereoCamera> camera;       // f 0: of unknown focal length; nothing: not even the size is known
  double scale = 1;                         // pixels of `camera` per pixel of the picture as it was given
  std::vector<storage::FrameRange> masked;  // no answers: the recent past of a frame that asks
  bool pair = false;                        // both eyes' pictures were given, and the right one shows something
  place::CameraKnown known = place::CameraKnown::kMeasuredWith;
  Vector3 eye_turn = Vector3::Zero();  // QueryPicture::eye_turn
};

// Decodes and describes pictures; checks features. INVALID_ARGUMENT (nothing to see; a frame with a camera),
// NO_SUCH_SESSION, SESSION_DELETED, NO_SUCH_FRAME, and the reasons of describe_picture() and from_wire().
Result<SeenView> see(const v1::View& view, const storage::Graph& graph);

}  // namespace relmap::rpc
