// Several lambdas as one function object, for std::visit.
#pragma once

namespace relmap {

template <typename... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <typename... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

}  // namespace relmap
