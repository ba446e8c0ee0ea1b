#include "server/route/overlay/cell_store.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "server/route/overlay/extents.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::route {
namespace {

Cell random_cell(std::mt19937& random) {
  Cell cell;
  cell.facts = {random() % 2 == 0, random() % 2 == 0, static_cast<std::uint32_t>(random() % 100),
                static_cast<double>(random() % 50)};
  const std::uint32_t nodes = random() % 20;
  cell.frames.begin.push_back(0);
  for (std::uint32_t n = 0; n < nodes; ++n) {
    cell.frames.nodes.push_back({1 + n / 7, 100 * n});  // ascending
    for (std::size_t links = random() % 3; links > 0; --links) {
      Link link;
      link.to = {static_cast<std::uint32_t>(1 + random() % 9), static_cast<std::uint32_t>(random())};
      link.metres = static_cast<double>(random()) / 7;
      link.variance_m2 = static_cast<double>(random()) / 3;
      link.driven_s = static_cast<float>(random() % 100) / 3;
      link.standing_s = static_cast<float>(random() % 100) / 7;
      link.ordinal = static_cast<std::uint32_t>(random());
      link.support = static_cast<std::uint32_t>(random());
      link.loop = random() % 2, link.forward = random() % 2, link.out = random() % 2, link.in = random() % 2;
      cell.frames.links.push_back(link);
    }
    cell.frames.begin.push_back(static_cast<std::uint32_t>(cell.frames.links.size()));
  }
  for (int metric = 0; metric < 3; ++metric) {
    CostMatrix matrix(nodes);
    for (std::uint32_t i = 0; i < nodes * nodes / 2; ++i)
      matrix.offer(random() % nodes, random() % nodes, static_cast<double>(random()) / 11);
    cell.within.push_back(std::move(matrix));
  }
  return cell;
}

void expect_same(const StoredCell& stored, const Cell& cell) {
  EXPECT_EQ(stored.facts(), cell.facts);
  EXPECT_EQ(stored.nodes(), cell.frames.nodes.size());
  EXPECT_EQ(*stored.frames(), cell.frames);
  for (std::size_t metric = 0; metric < cell.within.size(); ++metric) {
    EXPECT_EQ(*stored.within(metric, false), SplitCostMatrix(cell.within[metric]));
    EXPECT_EQ(*stored.within(metric, true),
              SplitCostMatrix(cell.facts.oneway ? cell.within[metric].transposed() : cell.within[metric]));
  }
}

TEST(CellStore, ReturnsWhatWasWritten) {
  const auto store = CellStore::open_temporary().or_throw();
  std::mt19937 random(1);
  std::vector<std::pair<Cell, std::shared_ptr<const StoredCell>>> cells;
  for (int step = 0; step < 1000; ++step) {
    if (cells.size() > 50) cells.erase(cells.begin() + static_cast<std::ptrdiff_t>(random() % cells.size()));
    Cell cell = random_cell(random);
    auto stored = store->write(cell);
    cells.emplace_back(std::move(cell), std::move(stored));
    const auto& [known, at] = cells[random() % cells.size()];
    expect_same(*at, known);
    if (random() % 10 == 0) store->evict(random() % 100'000);
  }
  Cell other = cells[0].first;
  other.facts.min_support += 1;
  EXPECT_NE(store->write(other, cells[0].second), cells[0].second);
  EXPECT_EQ(store->write(cells[0].first, cells[0].second), cells[0].second);
  EXPECT_GT(store->bytes_in_use(), 0u);
  cells.clear();
  EXPECT_EQ(store->bytes_in_use(), 0u) << "who holds no cell needs no room";
}

TEST(CellStore, HoldsInMemoryWhatTheBudgetAllows) {
  const auto budget = std::make_shared<storage::Budget>(40'000);
  const auto store = CellStore::open_temporary(budget).or_throw();
  std::mt19937 random(2);
  std::vector<std::pair<Cell, std::shared_ptr<const StoredCell>>> cells;
  for (int i = 0; i < 100; ++i) {
    Cell cell = random_cell(random);
    auto stored = store->write(cell);
    cells.emplace_back(std::move(cell), std::move(stored));
  }
  std::size_t max_used = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto& [cell, stored] = cells[random() % cells.size()];
    EXPECT_EQ(*stored->within(1, false), SplitCostMatrix(cell.within[1]));
    max_used = std::max(max_used, budget->used(storage::Share::kRoutes));
  }
  EXPECT_LE(max_used, budget->allowance(storage::Share::kRoutes));
  EXPECT_GT(max_used, budget->allowance(storage::Share::kRoutes) / 2);
  // What somebody holds is not evicted.
  std::vector<std::shared_ptr<const SplitCostMatrix>> held;
  const auto hold_all = [&] {
    for (const auto& [cell, stored] : cells) held.push_back(stored->within(0, false));
  };
  EXPECT_THROW(hold_all(), StatusError);
  EXPECT_LE(budget->used(storage::Share::kRoutes), budget->allowance(storage::Share::kRoutes));
  EXPECT_EQ(store->evict(1'000'000), 0u) << "all is held";
  EXPECT_EQ(cells[0].second->within(0, false), held[0]) << "and not read again";
  for (std::size_t i = 0; i < held.size(); ++i) EXPECT_EQ(*held[i], SplitCostMatrix(cells[i].first.within[0]));
  held.clear();
  store->evict(1'000'000);
  EXPECT_EQ(budget->used(storage::Share::kRoutes), 0u);
}

TEST(CellStore, CachesTheSamePartsOfACellThatReplacesAnother) {
  const auto budget = std::make_shared<storage::Budget>(10'000'000);
  const auto store = CellStore::open_temporary(budget).or_throw();
  std::mt19937 random(6);
  Cell cell = random_cell(random);
  while (cell.frames.nodes.size() < 10) cell = random_cell(random);
  const auto first = store->write(cell);
  (void)first->frames();
  (void)first->within(1, false);
  const std::size_t used = budget->used(storage::Share::kRoutes);
  Cell other = cell;
  for (CostMatrix& matrix : other.within) matrix.row(0)[1] = 0.5;
  const auto second = store->write(other, first);
  EXPECT_EQ(budget->used(storage::Share::kRoutes), 2 * used);
  const auto within = second->within(1, false);
  EXPECT_EQ(budget->used(storage::Share::kRoutes), 2 * used) << "it was there";
  EXPECT_EQ(*within, SplitCostMatrix(other.within[1]));
  (void)second->within(0, false);
  EXPECT_GT(budget->used(storage::Share::kRoutes), 2 * used);
  expect_same(*second, other);
}

TEST(CellStore, DetectsDamage) {
  const storage::TemporaryFolder temporary;
  const std::string folder = temporary / "map";
  std::filesystem::create_directory(folder);
  const auto store = CellStore::open(folder, std::make_shared<storage::Budget>(1'000'000), 0).or_throw();
  std::mt19937 random(3);
  Cell cell = random_cell(random);
  while (cell.frames.nodes.size() < 10) cell = random_cell(random);
  const auto stored = store->write(cell);
  expect_same(*stored, cell);
  store->evict(1'000'000);
  EXPECT_FALSE(store->is_damaged());
  {
    std::fstream file(folder + "/routes/cells", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(30);
    file.put('?');
  }
  EXPECT_THROW(stored->frames(), StatusError);
  EXPECT_TRUE(store->is_damaged());
  EXPECT_EQ(*stored->within(0, false), SplitCostMatrix(cell.within[0])) << "the rest is whole";
  // A new store begins empty while the earlier file can still be read.
  const auto other = CellStore::open(folder, std::make_shared<storage::Budget>(1'000'000), 0).or_throw();
  expect_same(*other->write(cell), cell);
  EXPECT_EQ(*stored->within(1, false), SplitCostMatrix(cell.within[1]));
  EXPECT_EQ(CellStore::open(folder + "/nowhere", nullptr, 0).reason(), Reason::NO_SUCH_FILE);
}

TEST(CellStore, LeavesRoomOnTheDiskForTheMap) {
  const storage::TemporaryFolder temporary;
  const std::string folder = temporary / "map";
  std::filesystem::create_directory(folder);
  std::mt19937 random(5);
  const Cell cell = random_cell(random);
  const auto budget = std::make_shared<storage::Budget>(1'000'000);
  const auto store = CellStore::open(folder, budget, 0).or_throw();
  auto stored = store->write(cell);
  const auto size = [&] { return std::filesystem::file_size(folder + "/routes/cells"); };
  EXPECT_GT(size(), 0u);
  store->trim();
  expect_same(*stored, cell);
  stored.reset();
  store->trim();
  EXPECT_EQ(size(), 0u) << "what nobody needs is given back";
  const auto other = CellStore::open(folder, budget, std::uint64_t{1} << 62).or_throw();
  EXPECT_THROW(other->write(cell), StatusError);
  EXPECT_EQ(other->bytes_in_use(), 0u);
}

TEST(Extents, DoNotOverlapAndAreReused) {
  std::mt19937 random(4);
  Extents extents;
  std::map<std::uint64_t, std::uint64_t> taken;
  std::uint64_t max_end = 0;
  for (int step = 0; step < 20'000; ++step) {
    if (random() % 2 == 0 && !taken.empty()) {
      const auto at = std::next(taken.begin(), static_cast<std::ptrdiff_t>(random() % taken.size()));
      extents.give_back(at->first, at->second);
      taken.erase(at);
    } else if (taken.size() < 100) {
      const std::uint64_t bytes = 1 + random() % 5000, offset = extents.take(bytes);
      const auto [at, fresh] = taken.emplace(offset, bytes);
      ASSERT_TRUE(fresh);
      if (at != taken.begin()) {
        ASSERT_LE(std::prev(at)->first + std::prev(at)->second, offset);
      }
      if (const auto after = std::next(at); after != taken.end()) {
        ASSERT_LE(offset + bytes, after->first);
      }
      ASSERT_LE(offset + bytes, extents.end());
      max_end = std::max(max_end, extents.end());
    }
  }
  EXPECT_LT(max_end, 2u * 100 * 5120);
  for (const auto& [offset, bytes] : taken) extents.give_back(offset, bytes);
  EXPECT_EQ(extents.end(), 0u);
  EXPECT_EQ(extents.in_use(), 0u);
}

}  // namespace
}  // namespace relmap::route
