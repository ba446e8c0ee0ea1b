// An immutable table of keys and values: the snapshot of the engines that keep the map in memory.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "storage/engine/engine.h"

namespace relmap::storage {

using Table = std::map<std::string, std::shared_ptr<const Bytes>, std::less<>>;

class TableSnapshot final : public EngineSnapshot {
 public:
  TableSnapshot(std::shared_ptr<const Table> table, std::uint64_t commit) : table_(std::move(table)), commit_(commit) {}

  std::uint64_t commit_number() const override { return commit_; }

  Result<std::optional<Bytes>> get(std::string_view key) const override {
    const auto found = table_->find(key);
    if (found == table_->end()) return std::optional<Bytes>();
    return std::optional<Bytes>(*found->second);
  }

  Status scan_from(std::string_view prefix, std::string_view from, const Visit& visit) const override {
    for (auto it = table_->lower_bound(from); it != table_->end() && it->first.starts_with(prefix); ++it)
      if (!visit(it->first, *it->second)) break;
    return {};
  }

  // The table after the puts and deletes. Unchanged values are shared, not copied.
  static std::shared_ptr<const Table> changed(const Table& table, std::span<const Put> puts,
                                              std::span<const std::string> deletes) {
    auto next = std::make_shared<Table>(table);
    for (const Put& put : puts) (*next)[put.key] = std::make_shared<const Bytes>(put.value);
    for (const std::string& key : deletes) next->erase(key);
    return next;
  }

  // Size of all keys and values.
  static std::uint64_t bytes(const Table& table) {
    std::uint64_t sum = 0;
    for (const auto& [key, value] : table) sum += key.size() + value->size();
    return sum;
  }

 private:
  const std::shared_ptr<const Table> table_;
  const std::uint64_t commit_;
};

}  // namespace relmap::storage
