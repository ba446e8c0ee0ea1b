#include "storage/graph/frame.h"

#include "proto/keyframe/extension_codec.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kAllocation = 16;  // what malloc and a shared_ptr's counts add to a block

template <typename T>
std::size_t heap(const std::vector<T>& items) {
  return items.capacity() == 0 ? 0 : items.capacity() * sizeof(T) + kAllocation;
}

}  // namespace

std::size_t memory_bytes(const FrameHot& frame) {
  std::size_t bytes = sizeof frame + 2 * kAllocation + heap(frame.edges) + heap(frame.incoming) +
                      heap(frame.landmarks) + heap(frame.unreached) + heap(frame.labels) + heap_bytes(frame.unknown);
  for (const Edge& edge : frame.edges)
    bytes += heap(edge.bound_frames) + heap(edge.consistent_with) + heap(edge.history) + heap(edge.carried_by) +
             heap(edge.unseen) + heap_bytes(edge.unknown) + (edge.around ? sizeof(WayAround) + kAllocation : 0);
  for (const Landmark& landmark : frame.landmarks) bytes += heap(landmark.claims) + heap(landmark.observers);
  for (const std::string& label : frame.labels) bytes += label.capacity();
  return bytes;
}

std::size_t memory_bytes(const FrameWarm& frame) { return sizeof frame + 2 * kAllocation + heap(frame.observations); }

std::size_t memory_bytes(const FrameCold& frame) {
  return sizeof frame + 2 * kAllocation + heap(frame.appearance) + heap(frame.words) + heap(frame.picture);
}

}  // namespace relmap::storage
