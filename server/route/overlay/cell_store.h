// Stores cells on disk, in DIR/routes/cells, and caches what searches need of them in memory as far as the budget has
// room. Cells can be made again from the map, so the file is synced only when a run ends in order.
//
// A cell is stored in one piece: its frames, and for each metric the costs between them, in both directions if these
// differ. Each of these parts has a checksum and is read by itself; parts in memory are evicted as others need room.
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

// A cell on disk. The destructor frees its space in the file. Thread-safe.
class StoredCell {
 public:
  ~StoredCell();
  StoredCell(const StoredCell&) = delete;
  StoredCell& operator=(const StoredCell&) = delete;

  const CellFacts& facts() const { return facts_; }
  std::uint32_t nodes() const { return nodes_; }
  // These two cache what they read, and what they return stays in memory as long as it is held. They throw StatusError:
  // IO_ERROR, DATA_LOSS, and BUDGET_EXCEEDED if there is no room even after everything that nobody holds was evicted.
  std::shared_ptr<const CellFrames> frames() const;
  // Costs from row to column or, if `backward`, from column to row.
  std::shared_ptr<const SplitCostMatrix> within(std::size_t metric, bool backward) const;
  // The same without cache and budget, for callers that need them once. They throw StatusError: IO_ERROR, DATA_LOSS.
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
  // Opens an empty store in a folder that exists; an earlier file of cells is removed. The store leaves
  // `room_for_others` bytes of the disk free. Errors: NO_SUCH_FILE, IO_ERROR, DISK_FULL, READ_ONLY.
  static Result<std::shared_ptr<CellStore>> open(const std::string& data_folder,
                                                 std::shared_ptr<storage::Budget> budget,
                                                 std::uint64_t room_for_others);
  // Opens a store in an unnamed file. Without a budget its memory is unlimited.
  static Result<std::shared_ptr<CellStore>> open_temporary(std::shared_ptr<storage::Budget> budget = nullptr);
  ~CellStore();

  // Writes a cell. `known` is an earlier cell of the same part of the map; it is returned if the two are identical.
  // Throws StatusError: IO_ERROR, DISK_FULL (also if only `room_for_others` is left).
  std::shared_ptr<const StoredCell> write(const Cell& cell, std::shared_ptr<const StoredCell> known = nullptr);
  // The same for a large cell: `within` is called for each matrix when it is about to be written.
  using Within = std::function<CostMatrix(std::size_t metric)>;
  std::shared_ptr<const StoredCell> write(const CellFacts& facts, const CellFrames& frames, std::size_t metrics,
                                          const Within& within, std::shared_ptr<const StoredCell> known);
  // Opens the file that an earlier run left, for cells that were put(). Errors as for open().
  static Result<std::shared_ptr<CellStore>> reopen(const std::string& data_folder,
                                                   std::shared_ptr<storage::Budget> budget,
                                                   std::uint64_t room_for_others);
  void put(ByteWriter& w, const StoredCell& cell) const;
  // Reads what put() wrote; null if the bytes are invalid.
  std::shared_ptr<const StoredCell> get(ByteReader& r);
  // Makes all that was written durable. IO_ERROR, DISK_FULL.
  Status sync();
  // Evicts at least `bytes` bytes from memory of what nobody holds, least recently used first. Returns how many bytes
  // were freed, which may be fewer.
  std::size_t evict(std::size_t bytes);
  // Truncates the file behind the last cell.
  void trim();
  // Whether a cell could not be read as it was written; then the store is of no use.
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
