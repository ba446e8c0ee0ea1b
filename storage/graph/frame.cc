#include "storage/graph/frame.h"

#include <bit>

#include "proto/keyframe/extension_codec.h"

namespace relmap::storage {
namespace {

// The memory of a block of so many bytes: jemalloc has four sizes of blocks between a power of two and the next.
std::size_t block(std::size_t bytes) {
  if (bytes <= 64) return (bytes + 15) / 16 * 16;
  const std::size_t step = std::bit_floor(bytes - 1) / 4;
  return (bytes + step - 1) / step * step;
}

template <typename T>
std::size_t heap(const std::vector<T>& items) {
  return block(items.capacity() * sizeof(T));
}

std::size_t heap(const std::string& text) {
  const bool inside = text.capacity() <= std::string().capacity();
  return inside ? 0 : block(text.capacity() + 1);
}

// What a shared_ptr to such an object holds, with its counts.
template <typename T>
std::size_t shared(const T&) {
  return block(sizeof(T) + 16);
}

}  // namespace

std::size_t memory_bytes(const FrameHot& frame) {
  std::size_t bytes = shared(frame) + heap(frame.edges) + heap(frame.incoming) + heap(frame.landmarks) +
                      heap(frame.unreached) + heap(frame.labels) + heap_bytes(frame.unknown);
  for (const Edge& edge : frame.edges)
    bytes += heap(edge.bound_frames) + heap(edge.consistent_with) + heap(edge.history) + heap(edge.carried_by) +
             heap(edge.unseen) + heap_bytes(edge.unknown) + (edge.around ? shared(*edge.around) : 0);
  for (const Landmark& landmark : frame.landmarks) bytes += heap(landmark.claims) + heap(landmark.observers);
  for (const std::string& label : frame.labels) bytes += heap(label);
  return bytes;
}

std::size_t memory_bytes(const FrameWarm& frame) { return shared(frame) + heap(frame.observations); }

std::size_t memory_bytes(const FrameCold& frame) {
  return shared(frame) + heap(frame.appearance) + heap(frame.words) + heap(frame.picture);
}

void shrink_deleted(Session& session) {
  session.header.unknown = {};
  session.unknown = {};
  session.deleted_by = {};
}

std::size_t memory_bytes(const Session& session) {
  return shared(session) + heap(session.header.robot) + heap(session.header.name) + heap(session.display_name) +
         heap_bytes(session.header.unknown) + heap_bytes(session.unknown) + heap(session.deleted_by);
}

}  // namespace relmap::storage
