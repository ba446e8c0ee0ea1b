#include "client/skeleton_picture.h"

namespace relmap::client {
namespace {

MapPicture::EdgeKind kind_of(const Skeleton::Point& point) {
  if (point.carried) return MapPicture::EdgeKind::kCarriedMotion;
  return point.unmeasured ? MapPicture::EdgeKind::kUnmeasuredMotion : MapPicture::EdgeKind::kMotion;
}

MapPicture::EdgeKind kind_of(const Skeleton::Closure& closure) {
  switch (closure.state) {
    case EdgeState::kCandidate:
      return MapPicture::EdgeKind::kLoopCandidate;
    case EdgeState::kQuarantined:
      return MapPicture::EdgeKind::kLoopQuarantined;
    case EdgeState::kRemoved:
      return MapPicture::EdgeKind::kLoopRemoved;
    case EdgeState::kAccepted:
      break;
  }
  return MapPicture::EdgeKind::kLoopAccepted;
}

}  // namespace

void add_skeleton(MapPicture& picture, const Skeleton& skeleton, const RelaxedSkeleton& layout) {
  for (const RelaxedSkeleton::Part& part : layout.parts) {
    MapPicture::Part& drawn = picture.parts.emplace_back();
    drawn.root = part.root;
    drawn.frames.reserve(part.places.size());
    for (const RelaxedSkeleton::Place& place : part.places) drawn.frames.push_back({place.frame, place.T_root_frame});
  }
  for (const Skeleton::Chain& chain : skeleton.chains)
    for (std::size_t i = 1; i < chain.points.size(); ++i)
      picture.edges.push_back({chain.points[i - 1].frame, chain.points[i].frame, kind_of(chain.points[i])});
  for (const Skeleton::Closure& closure : skeleton.closures)
    picture.edges.push_back({closure.a, closure.id.frame, kind_of(closure)});
}

}  // namespace relmap::client
