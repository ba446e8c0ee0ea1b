#include "server/rba/problem.h"

namespace relmap::rba {

void Problem::compose(std::vector<SE3>* poses) const {
  poses->resize(nodes.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const ProblemNode& node = nodes[n];
    if (node.parent < 0) {
      (*poses)[n] = SE3();
      continue;
    }
    const SE3& T_parent_base = (*poses)[static_cast<std::size_t>(node.parent)];
    const SE3& T_ab = edges[static_cast<std::size_t>(node.edge)].T_ab;
    (*poses)[n] = node.forward ? T_ab.inverse() * T_parent_base : T_ab * T_parent_base;
  }
}

}  // namespace relmap::rba
