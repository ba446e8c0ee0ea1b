// Cells on disk, DIR/routes/cells, and in memory as much of them as searches need and the budget has room for. They can
// be made again from the map: only when a run ends in order is anything synced.
//
// A cell lies in one piece: its frames, and for each metric the costs between them, in both directions where that makes
// a difference. Each of these parts has a checksum, is read by itself, and is the first to go when the room is needed.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "server/route/overlay/cell.h"
#include "storage/memory/budget.h"

namespace relmap::route {

class CellStore;

// Where a cell lies. With the last of those who hold it the cell is gone from the disk. Thread-safe.
class StoredCell {
 public:
  ~StoredCell();
  StoredCell(const StoredCell&) = delete;
  StoredCell& operator=(const StoredCell&) = delete;

  const CellFacts& facts() const { return facts_; }
  std::uint32_t nodes() const { return nodes_; }
  // They stay as long as they are held. All reads throw StatusError: IO_ERROR, DATA_LOSS; and these two BUDGET_EXCEEDED
  // (no room, though all that nobody holds has gone).
  std::shared_ptr<const CellFrames> frames() const;
  // From a frame to each (row to column); `backward`: to it from each.
  std::shared_ptr<const SplitCostMatrix> within(std::size_t metric, bool backward) const;
  // The same beside the budget, for whoever needs it once.
  CellFrames read_frames() const;
  CostMatrix read_within(std::size_t metric) const;

 private:
  friend class CellStore;
  StoredCell(std::shared_ptr<CellStore> store, CellFacts facts) : store_(std::move(store)), facts_(facts) {}
  std::uint64_t frames_bytes() const;
  std::uint64_t matrix_bytes() const;
  std::size_t frames_memory() const;
  std::size_t matrix_memory() const;
  std::uint64_t matrix_offset(std::size_t metric, bool backward) const;

  const std::shared_ptr<CellStore> store_;
  CellFacts facts_;
  std::uint64_t offset_ = 0, bytes_ = 0;
  std::uint32_t nodes_ = 0, links_ = 0, metrics_ = 0;
};

// Thread-safe.
class CellStore : public std::enable_shared_from_this<CellStore> {
 public:
  // Without cells, in a folder that exists: what stood there is gone. So many bytes of the disk are left to others.
  // Errors: NO_SUCH_FILE, IO_ERROR, DISK_FULL, READ_ONLY.
  static Result<std::shared_ptr<CellStore>> open(const std::string& data_folder,
                                                 std::shared_ptr<storage::Budget> budget,
                                                 std::uint64_t room_for_others);
  // In a file without a name. No budget: one that never ends.
  static Result<std::shared_ptr<CellStore>> open_temporary(std::shared_ptr<storage::Budget> budget = nullptr);
  ~CellStore();

  // Throws StatusError: IO_ERROR, DISK_FULL (there is no more room than is left to others). `known`: another of the
  // same part of the map; where the two are the same, it is given back.
  std::shared_ptr<const StoredCell> write(const Cell& cell, std::shared_ptr<const StoredCell> known = nullptr);
  // Of a large one: `within` gives each matrix when it is due.
  using Within = std::function<CostMatrix(std::size_t metric)>;
  std::shared_ptr<const StoredCell> write(const CellFacts& facts, const CellFrames& frames, std::size_t metrics,
                                          const Within& within, std::shared_ptr<const StoredCell> known);
  // For cells that were put(): what stands there is kept. Errors as those of open().
  static Result<std::shared_ptr<CellStore>> reopen(const std::string& data_folder,
                                                   std::shared_ptr<storage::Budget> budget,
                                                   std::uint64_t room_for_others);
  void put(ByteWriter& w, const StoredCell& cell) const;
  // What put() put; null: the bytes are not that.
  std::shared_ptr<const StoredCell> get(ByteReader& r);
  // What was written is durable on return. IO_ERROR, DISK_FULL.
  Status sync();
  // Of what is in memory, and nobody holds, so many bytes go, those first that were not asked for for the longest time.
  // Returns how many went.
  std::size_t evict(std::size_t bytes);
  // Gives the end of the file back to the disk where nothing stands any more.
  void trim();
  // A cell could not be read as it was written: what is there is of no use.
  bool is_damaged() const;
  std::uint64_t bytes_in_use() const;  // of the disk

 private:
  friend class StoredCell;
  struct Impl;
  explicit CellStore(std::unique_ptr<Impl> impl);
  static Result<std::shared_ptr<CellStore>> open_file(const std::string& folder,
                                                      std::shared_ptr<storage::Budget> budget,
                                                      std::uint64_t room_for_others);

  const std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::route
