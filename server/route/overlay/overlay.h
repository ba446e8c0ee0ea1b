// Nested cells for shortest routes through maps of millions of frames, each with the costs of passing through it
// ("Customizable route planning", Delling et al., SEA 2011). A search walks frames near its ends and passes cells
// between, larger ones the further it is from the ends.
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

// All cells of a map. A cell whose parts have changed is outdated and is not used until it is made anew: a search
// passes its parts instead. Copies share the cells.
class Overlay {
 public:
  // An overlay without cells. Throws StatusError (INVALID_ARGUMENT) if there are no metrics or one is not valid().
  Overlay(std::vector<RouteWeights> metrics, std::shared_ptr<CellStore> store);

  // Makes the cells of the whole map. `proceed` is called before each cell with the bytes of memory so far. Throws
  // StatusError where reads of the graph or the store do, or with what `proceed` returns; then nothing has changed.
  using Proceed = std::function<Status(std::size_t bytes)>;
  void build(const storage::Graph& graph, const Proceed& proceed = {});
  // Makes the cells of chunks anew whose frames have changed or are new, and of chunks that this affects. The cells
  // around them become outdated and are left to make_next(). Returns the number of chunks. Throws like build(); the
  // overlay is then in an undefined state, so callers should refresh a copy.
  std::size_t refresh(const storage::Graph& graph, std::span<const storage::ChunkId> changed);
  // Makes an outdated cell anew, smallest level first. Returns false if there is none. Throws StatusError where the
  // store does; the cell is then still outdated.
  bool make_next();
  std::size_t outdated() const { return waiting_.size(); }

  // Chunks whose frames have gone stay in the tree, and take memory, until the cells of the whole map are made anew.
  bool is_mostly_gone() const { return gone_.size() > kFewGone && 2 * gone_.size() > tree_->chunks(); }
  // Notes which chunks of the tree have gone from the map; refresh() does so by itself for those that it is told of.
  void note_gone(const storage::Graph& graph);

  std::span<const RouteWeights> metrics() const { return metrics_; }
  const CellTree& tree() const { return *tree_; }
  // Whether a search may pass the cell: it is not the root, and neither the cell nor any of its parts is outdated.
  bool is_current(std::uint32_t number) const { return number != tree_->root() && !waits_[number]; }
  // The cell, or null if it is not current.
  const StoredCell* cell(std::uint32_t number) const { return waits_[number] ? nullptr : cells_[number].get(); }
  // Memory outside the store.
  std::size_t memory_bytes() const;
  const std::shared_ptr<CellStore>& store() const { return store_; }

  void put(ByteWriter& w) const;
  // Reads what put() wrote; the store must still have the cells. nullopt if the bytes are invalid.
  static std::optional<Overlay> get(ByteReader& r, std::shared_ptr<CellStore> store);

 private:
  static constexpr std::size_t kFewGone = 64;

  std::shared_ptr<const StoredCell> make(std::uint32_t number, std::shared_ptr<const StoredCell> known) const;
  void outdate(std::uint32_t number);
  struct NewChunk {
    std::shared_ptr<const StoredCell> cell;
    std::vector<storage::ChunkId> ties;  // the chunks to which its edges lead, one entry for each edge
  };
  void add(const std::map<storage::ChunkId, NewChunk>& came);
  void divide(std::uint32_t number);
  template <typename Visit>
  void for_each_link(std::uint32_t number, const Visit& visit) const;

  std::vector<RouteWeights> metrics_;
  std::shared_ptr<CellStore> store_;
  std::shared_ptr<CellTree> tree_ = std::make_shared<CellTree>();
  // By the number in the tree:
  std::vector<std::shared_ptr<const StoredCell>> cells_;
  std::vector<bool> waits_;                                    // whether the cell or one within it is outdated
  std::set<std::pair<std::uint32_t, std::uint32_t>> waiting_;  // level and number of the cells that wait
  std::set<std::uint32_t> outdated_;                           // cells of which a direct part has changed
  std::set<std::uint32_t> gone_;                               // chunks without a frame
};

}  // namespace relmap::route
