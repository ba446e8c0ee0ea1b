// A graph whose frames can be changed: the map (storage/map/map.h), or a draft of it (storage/map/draft.h). What works
// on one works on the other, so that what an edit would do can be told without doing it.
#pragma once

#include "storage/graph/graph.h"

namespace relmap::storage {

struct MapState;

class EditableGraph : public Graph {
 public:
  // A private copy, made at the first edit. The frame must exist (else StatusError, NO_SUCH_FRAME). From then on hot()
  // and warm() give this same copy, so what they returned after the first edit changes with later ones.
  virtual FrameHot& edit_hot(FrameId id) = 0;
  virtual FrameWarm& edit_warm(FrameId id) = 0;
  virtual MapState& state() = 0;
};

}  // namespace relmap::storage
