// Cells on disk, DIR/routes/cells, and in memory as much of them as searches need and the budget has room for. They can
// be made again from the map: nothing is synced.
//
// A cell lies in one piece: its frames, and for each metric the costs between them, in both directions where that makes
// a difference. Each of these parts has a checksum, is read by itself, and is the first to go when the room is needed.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "proto/status.h"
#include "server/route/overlay/cell.h"
#include "storage/budget.h"

namespace relmap {

class CellStore;

// Where a cell lies. With the last of those who hold it the cell is gone from the disk. Thread-safe.
class StoredCell {
 public:
  ~StoredCell();
  StoredCell(const StoredCell&) = delete;
  StoredCell& operator=(const StoredCell&) = delete;

  const CellFacts& facts() const { return facts_; }
  std::uint32_t nodes() const { return nodes_; }
  // They stay as long as they are held. Throw StatusError: IO_ERROR, DATA_LOSS, BUDGET_EXCEEDED (no room, though all
  // that nobody holds has gone).
  std::shared_ptr<const CellFrames> frames() const;
  // From a frame to each (row to column); `backward`: to it from each.
  std::shared_ptr<const SplitCostMatrix> within(std::size_t metric, bool backward) const;
  // All of it, beside the budget.
  Cell read() const;
  // As it would be stored.
  bool is(const Cell& other) const;

 private:
  friend class CellStore;
  StoredCell(std::shared_ptr<CellStore> store, CellFacts facts) : store_(std::move(store)), facts_(facts) {}
  std::uint64_t frames_bytes() const;
  std::uint64_t matrix_bytes() const;

  const std::shared_ptr<CellStore> store_;
  const CellFacts facts_;
  std::uint64_t offset_ = 0, bytes_ = 0;
  std::uint32_t nodes_ = 0, links_ = 0, metrics_ = 0;
};

// Thread-safe.
class CellStore : public std::enable_shared_from_this<CellStore> {
 public:
  // Without cells, in a folder that exists: what stood there is gone. IO_ERROR, DISK_FULL.
  static Result<std::shared_ptr<CellStore>> open(const std::string& data_folder, std::shared_ptr<Budget> budget);
  // In a file without a name. No budget: one that never ends.
  static Result<std::shared_ptr<CellStore>> open_temporary(std::shared_ptr<Budget> budget = nullptr);
  ~CellStore();

  // Throws StatusError: IO_ERROR, DISK_FULL, long before the map has to refuse keyframes for want of room.
  std::shared_ptr<const StoredCell> write(const Cell& cell);
  // Of what is in memory so many bytes go, those first that were not asked for for the longest time.
  void evict(std::size_t bytes);
  // A cell could not be read as it was written: what is there is of no use.
  bool is_damaged() const;
  std::uint64_t disk_bytes() const;

 private:
  friend class StoredCell;
  struct Impl;
  explicit CellStore(std::unique_ptr<Impl> impl);

  const std::unique_ptr<Impl> impl_;
};

}  // namespace relmap
