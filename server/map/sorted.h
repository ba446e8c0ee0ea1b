// Sorted vectors as small sets, used for the derived lists of a frame.
#pragma once

#include <algorithm>
#include <vector>

namespace relmap::map {

template <typename T>
void sort_unique(std::vector<T>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

// Inserts the value unless it is there. True if it was inserted.
template <typename T>
bool insert_sorted(std::vector<T>& list, const T& value) {
  const auto at = std::lower_bound(list.begin(), list.end(), value);
  if (at != list.end() && *at == value) return false;
  list.insert(at, value);
  return true;
}

}  // namespace relmap::map
