// Writes the evidence for closures and answers into relmap.v1 messages. Internal to server/rpc, since it exposes
// generated code.
#pragma once

#include <span>
#include <vector>

#include "relmap/v1/evidence.pb.h"
#include "server/place/picture_query.h"
#include "server/place/point_match.h"
#include "storage/graph/frame.h"
#include "storage/graph/graph.h"

namespace relmap::rpc {

inline constexpr int kMaxCorrespondences = 1024;  // of one answer

// Adds the matches, at most kMaxCorrespondences. `features` are those of the view, and `sent` turns their pixels into
// those of the view as it was sent.
void add_correspondences(std::span<const place::PointMatch> matches, std::span<const AppearanceFeature> features,
                         const place::SentPixels& sent, google::protobuf::RepeatedPtrField<v1::Correspondence>& into);

// The picture that is kept of a frame; without data, and with the reason, if there is none. UNSUPPORTED: the robot sent
// none, or the frame was imported. DATA_LOSS: the part that held it was lost. NO_SUCH_FRAME.
v1::FramePicture picture_message(const storage::Graph& graph, FrameId frame);

// How doubtful the closure is; absent for an edge that is none.
void tell_suspicion(const storage::Edge& edge, v1::Edge& message);

}  // namespace relmap::rpc
