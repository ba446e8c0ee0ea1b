#include "server/route/unmeasured.h"

#include "server/route/weight.h"
#include "storage/unmeasured.h"

namespace relmap {

void UnmeasuredStretches::add(const Edge& edge) {
  if (!is_unmeasured(edge)) return;
  ++steps_;
  distance_m_ += length_m(edge);
  UnmeasuredStretch* const stretch = extend(edge.a, edge.b);
  if (!stretch) return;
  ++stretch->steps;
  stretch->distance_m += length_m(edge);
}

}  // namespace relmap
