// Shortest routes through maps of millions of frames: nested cells, each with the costs of passing it ("Customizable
// route planning", Delling et al., SEA 2011). A search walks frames where it begins and ends, and cells, the larger
// the further, between.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "proto/base/status.h"
#include "server/route/overlay/cell.h"
#include "server/route/overlay/cell_store.h"
#include "server/route/overlay/cell_tree.h"

namespace relmap::route {

// All cells of a map. What is outdated is not there until it is made anew: a search opens it, and passes its parts.
// A copy shares the cells.
class Overlay {
 public:
  // At least one; throws StatusError, INVALID_ARGUMENT, where one is not valid().
  Overlay(std::vector<RouteWeights> metrics, std::shared_ptr<CellStore> store);

  // Of the whole map. Throws StatusError where reads of the graph do, or the store, and what `proceed` says, which is
  // asked before each cell with memory_bytes() so far. Then nothing has changed.
  using Proceed = std::function<Status(std::size_t bytes)>;
  void build(const storage::Graph& graph, const Proceed& proceed = {});
  // After frames of these chunks changed, or came: makes the cells of the chunks that this concerns, and leaves those
  // around them, where they are others now, to make_next(). Returns how many it made. Throws as build() does, and then
  // it is of no use any more: to be tried with a copy.
  std::size_t refresh(const storage::Graph& graph, std::span<const storage::ChunkId> changed);
  // One that is outdated, the smallest first. False: there is none. Throws StatusError where the store does; then it is
  // outdated still.
  bool make_next();
  std::size_t outdated() const { return waiting_.size(); }

  std::span<const RouteWeights> metrics() const { return metrics_; }
  const CellTree& tree() const { return *tree_; }
  // Neither the root nor outdated; nor are its parts, then.
  bool is_current(std::uint32_t number) const { return number != tree_->root() && !waits_[number]; }
  // Null: it is not current.
  const StoredCell* cell(std::uint32_t number) const { return waits_[number] ? nullptr : cells_[number].get(); }
  // Of what stands beside the store.
  std::size_t memory_bytes() const;
  const std::shared_ptr<CellStore>& store() const { return store_; }

  void put(ByteWriter& w) const;
  // What put() put, of a store that has the cells still; nullopt: the bytes are not that.
  static std::optional<Overlay> get(ByteReader& r, std::shared_ptr<CellStore> store);

 private:
  std::shared_ptr<const StoredCell> make(std::uint32_t number, std::shared_ptr<const StoredCell> known) const;
  void outdate(std::uint32_t number);
  struct NewChunk {
    std::shared_ptr<const StoredCell> cell;
    std::vector<storage::ChunkId> ties;  // where its edges lead, one each
  };
  void add(const std::map<storage::ChunkId, NewChunk>& came);
  void divide(std::uint32_t number);
  template <typename Visit>
  void for_each_link(std::uint32_t number, const Visit& visit) const;

  std::vector<RouteWeights> metrics_;
  std::shared_ptr<CellStore> store_;
  std::shared_ptr<CellTree> tree_ = std::make_shared<CellTree>();
  // By their numbers in the tree.
  std::vector<std::shared_ptr<const StoredCell>> cells_;
  std::vector<bool> waits_;                                    // it, or one in it, is outdated
  std::set<std::pair<std::uint32_t, std::uint32_t>> waiting_;  // those, by level
  std::set<std::uint32_t> outdated_;                           // those of which a part has changed
};

}  // namespace relmap::route
