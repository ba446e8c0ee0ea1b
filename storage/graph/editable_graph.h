// A graph whose frames can be changed: the map (storage/map/map.h), or a draft of it (storage/map/draft.h). Code that
// edits one can edit the other, so what an edit would do can be found out without doing it.
#pragma once

#include "storage/graph/graph.h"

namespace relmap::storage {

struct MapState;

class EditableGraph : public Graph {
 public:
  // The frame's private copy, which is made at the first edit. The frame must exist (otherwise StatusError,
  // NO_SUCH_FRAME). From then on hot() and warm() return this same copy, so what they return changes with later edits.
  virtual FrameHot& edit_hot(FrameId id) = 0;
  virtual FrameWarm& edit_warm(FrameId id) = 0;
  virtual MapState& state() = 0;
};

}  // namespace relmap::storage
