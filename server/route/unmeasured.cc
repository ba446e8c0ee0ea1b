#include "server/route/unmeasured.h"

#include "server/route/weight.h"
#include "storage/graph/frame.h"

namespace relmap::route {

void UnmeasuredStretches::add(const storage::Edge& edge) {
  if (!storage::is_unmeasured(edge)) return;
  ++steps_;
  distance_m_ += length_m(edge);
  UnmeasuredStretch* const stretch = extend(edge.a, edge.b);
  if (!stretch) return;
  ++stretch->steps;
  stretch->distance_m += length_m(edge);
}

}  // namespace relmap::route
