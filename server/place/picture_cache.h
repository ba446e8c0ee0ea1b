// A cache of the decoded pictures of the map's frames, in which landmarks are measured (server/place/reobserve.h).
#pragma once

#include <cstdint>
#include <list>
#include <memory>

#include "frontend/vision/pyramid.h"
#include "proto/base/mutex.h"
#include "storage/graph/graph.h"

namespace relmap::place {

struct FramePicture {
  vision::Pyramid pyramid;  // its levels are those of the camera's picture from `first` on
  int first = 0;            // how many times the stored picture has been halved

  int last() const { return first + pyramid.levels() - 1; }
  vision::ImageView level(int of_camera) const { return pyramid.level(of_camera - first); }
};

// A cache for one map. Keeps the 16 MB of pictures that were used last, since the next frame of a robot needs nearly
// the same ones. Thread-safe: a picture that several threads want is decoded by one of them, and the others wait.
class PictureCache {
 public:
  // Returns the picture of a frame. Null if there is none, if it is a thumbnail or a PNG, cannot be decoded or has more
  // than a megapixel, or if its size is not that of the camera, halved at most vision::kMaxHalvings times. Throws
  // StatusError where reads of the graph do.
  std::shared_ptr<const FramePicture> find(const storage::Graph& graph, FrameId frame);

 private:
  enum class Stage : std::uint8_t { kNew, kInWork, kDecoded };
  struct Entry {
    FrameId frame;
    Stage stage = Stage::kNew;
    std::shared_ptr<const FramePicture> picture = {};  // once decoded
    std::size_t bytes = 0;                             // as counted in bytes_
  };
  void drop_oldest() RELMAP_REQUIRES(mutex_);

  Mutex mutex_;  // guards the entries, too, while somebody holds one that has been dropped
  ConditionVariable decoded_;
  std::list<std::shared_ptr<Entry>> entries_ RELMAP_GUARDED_BY(mutex_);  // most recently used first
  std::size_t bytes_ RELMAP_GUARDED_BY(mutex_) = 0;
};

}  // namespace relmap::place
