// Pictures of the map's frames, decoded: landmarks are measured in them (server/place/reobserve.h).
#pragma once

#include <list>
#include <memory>

#include "frontend/vision/pyramid.h"
#include "storage/graph/graph.h"

namespace relmap::place {

struct FramePicture {
  vision::Pyramid pyramid;  // from level `first` of the camera's picture on
  int first = 0;

  int last() const { return first + pyramid.levels() - 1; }
  vision::ImageView level(int of_camera) const { return pyramid.level(of_camera - first); }
};

// Of one map. Keeps what was used last, 16 MB of it: the next frame of a robot needs nearly the same. Not thread safe.
class PictureCache {
 public:
  // Null where the frame has no picture, a thumbnail, one that cannot be decoded, of more than a megapixel, or of
  // another size than the camera's, halved once or twice perhaps.
  std::shared_ptr<const FramePicture> find(const storage::Graph& graph, FrameId frame);

 private:
  struct Entry {
    FrameId frame;
    std::shared_ptr<const FramePicture> picture;
  };
  std::list<Entry> entries_;  // the last used first
  std::size_t bytes_ = 0;
};

}  // namespace relmap::place
