// A queue whose owners take turns: each turn serves one item of one owner, so that an owner of many items keeps no
// other waiting.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace relmap {

// Items of one owner keep their order. Not thread-safe.
template <typename Item, typename Owner = std::string>
class TurnQueue {
 public:
  bool empty() const { return turns_.empty(); }
  std::size_t size() const { return size_; }
  void push(const Owner& owner, Item item) {
    std::deque<Item>& items = items_[owner];
    if (items.empty()) turns_.push_back(owner);
    items.push_back(std::move(item));
    ++size_;
  }
  // Takes out the last item of the owner of most, so that there is room for another one of `owner`'s; nullopt if nobody
  // has more than `owner` would have then.
  std::optional<Item> make_room(const Owner& owner) {
    const auto own = items_.find(owner);
    const auto most = std::max_element(items_.begin(), items_.end(),
                                       [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
    if (most == items_.end() || most->second.size() <= (own == items_.end() ? 0 : own->second.size()) + 1)
      return std::nullopt;
    Item last = std::move(most->second.back());
    most->second.pop_back();
    --size_;
    return last;
  }
  // The item whose turn it is. Requires !empty().
  const Item& front() const { return items_.find(turns_.front())->second.front(); }
  // Takes it out. Its owner's next turn comes after one of each other owner.
  Item pop() {
    const auto owner = items_.find(turns_.front());
    turns_.pop_front();
    Item item = std::move(owner->second.front());
    owner->second.pop_front();
    --size_;
    if (owner->second.empty())
      items_.erase(owner);
    else
      turns_.push_back(owner->first);
    return item;
  }
  // Removes it, wherever it stands.
  void erase(const Item& item) {
    for (auto owner = items_.begin(); owner != items_.end();) {
      size_ -= std::erase(owner->second, item);
      if (owner->second.empty()) {
        std::erase(turns_, owner->first);
        owner = items_.erase(owner);
      } else {
        ++owner;
      }
    }
  }

 private:
  std::map<Owner, std::deque<Item>> items_;
  std::deque<Owner> turns_;  // owners of items, each once
  std::size_t size_ = 0;
};

}  // namespace relmap
