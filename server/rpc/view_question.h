// relmap.v1.View to what localise.h asks: features and a camera. Internal to server/rpc: shows generated code.
#pragma once

#include <optional>
#include <vector>

#include "proto/camera.h"
#include "proto/keyframe.h"
#include "relmap/v1/common.pb.h"
#include "storage/graph.h"

namespace relmap {

struct SeenView {
  std::vector<AppearanceFeature> features;
  std::optional<StereoCamera> camera;
};

// Decodes and describes pictures; checks features. INVALID_ARGUMENT (nothing to see), NO_SUCH_SESSION, and the reasons
// of describe_picture() and from_wire().
Result<SeenView> see(const v1::View& view, const Graph& graph);

}  // namespace relmap
