// A queue whose owners take turns: each turn serves one item of one owner, so that an owner of many items keeps no
// other waiting.
#pragma once

#include <algorithm>
#include <deque>
#include <map>
#include <string>
#include <utility>

namespace relmap {

// Items of one owner keep their order. Not thread-safe.
template <typename Item>
class TurnQueue {
 public:
  bool empty() const { return turns_.empty(); }
  void push(const std::string& owner, Item item) {
    std::deque<Item>& items = items_[owner];
    if (items.empty()) turns_.push_back(owner);
    items.push_back(std::move(item));
  }
  // The item whose turn it is. Requires !empty().
  const Item& front() const { return items_.find(turns_.front())->second.front(); }
  // Takes it out. Its owner's next turn comes after one of each other owner.
  Item pop() {
    const auto owner = items_.find(turns_.front());
    turns_.pop_front();
    Item item = std::move(owner->second.front());
    owner->second.pop_front();
    if (owner->second.empty())
      items_.erase(owner);
    else
      turns_.push_back(owner->first);
    return item;
  }
  // Removes it, wherever it stands.
  void erase(const Item& item) {
    for (auto owner = items_.begin(); owner != items_.end();) {
      std::erase(owner->second, item);
      if (owner->second.empty()) {
        std::erase(turns_, owner->first);
        owner = items_.erase(owner);
      } else {
        ++owner;
      }
    }
  }

 private:
  std::map<std::string, std::deque<Item>> items_;
  std::deque<std::string> turns_;  // owners of items, each once
};

}  // namespace relmap
