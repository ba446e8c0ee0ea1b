// Which closures should become edges of the graph (paper, 3.1: an open question; docs/method.md, 2): few, so that the
// graph stays nearly a tree, or every one.
#pragma once

#include <cstdint>
#include <string>

#include "tools/bench/report.h"

namespace relmap::bench {

struct EdgesOptions {
  std::uint32_t window = 8;
  int seeds = 1;
  bool full = true;     // also compute the full solution
  std::string picture;  // empty: none
};

void run_edges(const EdgesOptions& options, Report& report);

}  // namespace relmap::bench
