// Which edges of the map a list has, beyond what route::EdgeFilter tells, and in which order closures are listed.
#pragma once

#include <cstdint>
#include <optional>

#include "server/route/edge_list.h"
#include "storage/graph/digest.h"
#include "storage/graph/frame_set.h"

namespace relmap::map {

// The suspicion of a closure (suspicion.h) as its digest gives it, which has it to four digits: what lists show,
// compare and order by.
double listed_suspicion(const storage::Edge& edge);

struct EdgeChoice {
  route::EdgeFilter filter;
  std::int64_t from_us = 0, until_us = 0;   // when the newer end was taken, UTC: then or later, and before; 0: any
  double min_suspicion = 0;                 // more than 0: only loop closures at least as suspicious
  std::optional<storage::FrameSet> region;  // edges with an end among these

  // `time_us` is that of the newer end.
  bool has(const storage::Edge& edge, std::int64_t time_us) const;
  // Whether it has the closure, `suspicion` being its suspicion_value().
  bool has(const storage::ClosureDigest& closure, std::int64_t time_us, double suspicion) const;
  // False if it does not have the edge of a robot's motion that leads to this frame. A digest does not tell between
  // odometry and prior edges, nor where they begin, so true says little.
  bool may_have_motion(FrameId to, std::int64_t time_us) const;

 private:
  bool has_time(std::int64_t time_us) const {
    return (from_us == 0 || time_us >= from_us) && (until_us == 0 || time_us < until_us);
  }
  bool is_near(FrameId a, FrameId b) const { return !region || region->contains(a) || region->contains(b); }
};

}  // namespace relmap::map
