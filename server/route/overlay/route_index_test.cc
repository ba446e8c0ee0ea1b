#include "server/route/overlay/route_index.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "server/route/dijkstra.h"
#include "server/route/overlay/overlay_search.h"
#include "server/route/testing/live_town.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::route {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

void expect_as_dijkstra(const RouteIndex::Snapshot& map, std::size_t metric, FrameId from, FrameId to) {
  ASSERT_TRUE(map.overlay);
  OverlayQuery query;
  query.metric = metric;
  query.stale = map.stale;
  RouteFilter filter;
  if (from.index % 3 == 0) filter.avoided = {FrameId{to.session, to.index / 2 + 1}};
  if (auto opened = cells_to_open(*map.overlay, filter)) {
    query.filter = filter;
    query.opened = *std::move(opened);
  }
  const std::vector<FrameId> starts{from}, goals{to};
  const auto found = find_route(*map.overlay, *map.view, query, starts, goals);
  RouteOptions options;
  options.weights = kTownMetrics[metric];
  options.filter = query.filter;
  const auto expected = find_route(*map.view, starts, goals, options);
  ASSERT_EQ(found.ok(), expected.ok()) << from.to_string() << " " << to.to_string() << " "
                                       << found.status().to_string();
  if (expected.ok()) {
    EXPECT_NEAR(found->cost, expected->cost, 1e-9 * expected->cost);
  } else {
    EXPECT_EQ(found.reason(), expected.reason());
  }
}

TEST(RouteIndexUpdates, KeepsUpWithTheMap) {
  LiveTown town;
  town.drive(200);
  const auto index = town.index();
  EXPECT_FALSE(index->snapshot().overlay);
  EXPECT_NE(index->snapshot().missing_because, "");
  index->start();
  std::mt19937 random(1);
  for (int round = 0; round < 30; ++round) {
    ASSERT_TRUE(round % 3 || index->wait_current(Clock::now() + 60s));
    const auto map = index->snapshot();
    if (round % 3 == 0) {
      EXPECT_TRUE(map.stale.empty());
      EXPECT_EQ(map.overlay->outdated(), 0u);
    }
    EXPECT_EQ(map.view->version(), town.map().view()->version());
    for (int i = 0; i < 5; ++i)
      expect_as_dijkstra(map, random() % kTownMetrics.size(), town.random_frame(random), town.random_frame(random));
    town.drive(90);
    town.change(random);
  }
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  EXPECT_EQ(index->snapshot().overlay->tree().chunks(), 4 * ((200 + 30 * 90 + 63) / storage::kFramesPerChunk));
  EXPECT_GT(town.budget().used(storage::Share::kRoutes), 0u);
}

TEST(RouteIndexUpdates, KeepsUpWithASessionThatIsDeleted) {
  LiveTown town;
  town.drive(1000);
  const auto index = town.index();
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  std::mt19937 random(4);
  for (std::uint32_t round = 0; town.map().session(2)->frames > 0; ++round) {
    town.remove_chunk(2);
    ASSERT_TRUE(round % 2 == 0 || index->wait_current(Clock::now() + 60s));
    const auto map = index->snapshot();
    const auto some_frame = [&] {
      FrameId id = town.random_frame(random);
      while (!map.view->hot(id)) id = town.random_frame(random);
      return id;
    };
    for (int i = 0; i < 10; ++i) expect_as_dijkstra(map, random() % kTownMetrics.size(), some_frame(), some_frame());
  }
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  EXPECT_EQ(index->snapshot().overlay->outdated(), 0u);
}

TEST(RouteIndexUpdates, WhatDeletedSessionsTookIsGivenBack) {
  LiveTown town;
  town.drive(3000);
  constexpr std::uint32_t kChunks = 3000 / storage::kFramesPerChunk + 1;
  const auto remove = [&](SessionNumber session) {
    while (town.map().session(session)->frames > 0) town.remove_chunk(session);
  };
  const auto chunks = [](const RouteIndex& index) { return index.snapshot().overlay->tree().chunks(); };
  auto index = town.index();
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  EXPECT_EQ(chunks(*index), 4 * kChunks);
  const std::size_t used = town.budget().used(storage::Share::kRoutes);
  Overlay saved(kTownMetrics, CellStore::open_temporary().or_throw());  // as an earlier run would have left it
  saved.build(*town.map().view());
  remove(2);
  remove(3);
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  EXPECT_EQ(chunks(*index), 4 * kChunks) << "half is not worth it";
  remove(4);
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  EXPECT_LT(chunks(*index), 2 * kChunks) << "they are made anew as soon as more than half have gone";
  EXPECT_LT(town.budget().used(storage::Share::kRoutes), used);
  EXPECT_FALSE(saved.is_mostly_gone());
  saved.note_gone(*town.map().view());
  EXPECT_TRUE(saved.is_mostly_gone());
}

// One thread edits the map, one makes cells, and two search.
TEST(RouteIndex, IsRightWhileTheMapChanges) {
  LiveTown town;
  town.drive(600);
  const auto index = town.index();
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  std::atomic<int> asked = 0;
  std::vector<std::thread> askers;
  for (int asker = 0; asker < 2; ++asker)
    askers.emplace_back([&, asker] {
      std::mt19937 random(static_cast<std::uint32_t>(asker));
      for (; asked < 150; ++asked) {
        const auto map = index->snapshot();
        const auto frame = [&] {
          const SessionNumber robot = 1 + static_cast<SessionNumber>(random() % 4);
          return FrameId{robot, static_cast<std::uint32_t>(random() % map.view->session(robot)->frames)};
        };
        expect_as_dijkstra(map, random() % kTownMetrics.size(), frame(), frame());
      }
    });
  std::mt19937 random(9);
  while (asked < 150) {
    town.change(random);
    town.drive(random() % 4 == 0 ? 1 : 0);
    std::this_thread::sleep_for(2ms);
  }
  for (std::thread& asker : askers) asker.join();
}

TEST(RouteIndexMemory, ObeysItsShare) {
  // Most cells are on disk then.
  LiveTown town(std::size_t{1} << 20);
  town.drive(3000);
  ASSERT_TRUE(town.map().commit().ok());
  const auto index = town.index();
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  std::mt19937 random(3);
  for (int i = 0; i < 60; ++i) {
    if (i % 10 == 0) town.change(random);
    expect_as_dijkstra(index->snapshot(), random() % kTownMetrics.size(), town.random_frame(random),
                       town.random_frame(random));
    EXPECT_LE(town.budget().used(storage::Share::kRoutes), (std::size_t{1} << 20) / 4 * 3);
  }
}

// Each search holds the cells that it passes, and the memory must suffice for all of them in turn.
TEST(RouteIndex, ManySearchesShareLittleMemory) {
  LiveTown town(std::size_t{1} << 20);
  town.drive(2000);
  ASSERT_TRUE(town.map().commit().ok());
  const auto index = town.index();
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  std::atomic<int> found = 0, asking = 3;
  std::vector<std::thread> askers;
  for (unsigned seed = 1; seed <= 3; ++seed)
    askers.emplace_back([&, seed] {
      std::mt19937 random(seed);
      for (int i = 0; i < 20; ++i) {
        const RouteIndex::Snapshot map = index->snapshot();
        if (!map.overlay) continue;
        OverlayQuery query;
        query.metric = random() % kTownMetrics.size();
        query.stale = map.stale;
        const std::vector<FrameId> from{town.random_frame(random)}, to{town.random_frame(random)};
        RouteOptions options;
        options.weights = kTownMetrics[query.metric];
        try {
          const auto route = find_route(*map.overlay, *map.view, query, from, to);
          const auto expected = find_route(*map.view, from, to, options);
          EXPECT_EQ(route.ok(), expected.ok()) << route.status().to_string();
          if (!route.ok() || !expected.ok()) continue;
          EXPECT_NEAR(route->cost, expected->cost, 1e-9 * expected->cost);
          ++found;
        } catch (const StatusError& error) {  // other searches hold all of the memory
          EXPECT_EQ(error.status().reason(), Reason::BUDGET_EXCEEDED) << error.status().to_string();
        }
      }
      --asking;
    });
  std::mt19937 random(4);
  while (asking > 0) {
    town.change(random);
    EXPECT_TRUE(town.map().commit().ok());  // uncommitted data would take the room of the cells
    std::this_thread::sleep_for(5ms);
  }
  for (std::thread& asker : askers) asker.join();
  EXPECT_GT(found, 15);
  EXPECT_LE(town.budget().used(storage::Share::kRoutes), (std::size_t{1} << 20) / 4 * 3);
}

TEST(RouteIndex, HasNoCellsWhereNotEvenItsTablesFit) {
  LiveTown town(std::size_t{64} << 10);
  town.drive(3000);
  ASSERT_TRUE(town.map().commit().ok());
  const auto index = town.index();
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  const auto map = index->snapshot();
  EXPECT_FALSE(map.overlay);
  EXPECT_NE(map.missing_because.find("memory_budget_mb"), std::string::npos) << map.missing_because;
  EXPECT_EQ(town.budget().used(storage::Share::kRoutes), 0u);
  std::mt19937 random(3);
  town.change(random);  // must do no harm
}

// Cells are dropped where other shares need the memory, since they can be made again.
TEST(RouteIndex, YieldsToOtherSharesAndComesBack) {
  LiveTown town;
  town.drive(1000);
  const auto index = town.index();
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  ASSERT_TRUE(index->snapshot().overlay);
  const auto until = [&](bool there) {
    for (const auto end = Clock::now() + 60s; Clock::now() < end; std::this_thread::sleep_for(1ms))
      if (bool(index->snapshot().overlay) == there) return true;
    return false;
  };
  town.budget().charge(storage::Share::kReplies, town.budget().limit());
  EXPECT_TRUE(until(false));
  EXPECT_NE(index->snapshot().missing_because, "");
  std::mt19937 random(4);
  town.change(random);
  town.budget().release(storage::Share::kReplies, town.budget().limit());
  EXPECT_TRUE(until(true));
  for (int i = 0; i < 20; ++i)
    expect_as_dijkstra(index->snapshot(), 0, town.random_frame(random), town.random_frame(random));
}

// As after an import: all cells are made anew together rather than grown.
TEST(RouteIndex, IsMadeAnewWhenMostOfTheMapIsNew) {
  LiveTown town;
  town.drive(100);
  const auto index = town.index();
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  town.drive(2500);
  std::mt19937 random(5);
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  for (int i = 0; i < 20; ++i)
    expect_as_dijkstra(index->snapshot(), 1, town.random_frame(random), town.random_frame(random));
}

TEST(RouteIndex, TriesAgainWhenTheMapCannotBeRead) {
  LiveTown town;
  town.drive(300);
  const auto index = town.index();
  town.views_fail = true;
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  town.views_fail = false;
  for (const auto end = Clock::now() + 60s; !index->snapshot().overlay && Clock::now() < end;)
    std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(index->snapshot().overlay);
  expect_as_dijkstra(index->snapshot(), 0, {1, 0}, {4, 299});
}

TEST(RouteIndex, MakesDamagedCellsAnew) {
  const storage::TemporaryFolder temporary;
  const std::string folder = temporary / "map";
  std::filesystem::create_directory(folder);
  LiveTown town;
  town.drive(2000);
  const auto index = town.index(folder);
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  const std::string path = folder + "/routes/cells";
  const std::string nothing(std::filesystem::file_size(path), '\0');
  std::fstream(path, std::ios::in | std::ios::out | std::ios::binary) << nothing;
  const auto map = index->snapshot();
  EXPECT_THROW(expect_as_dijkstra(map, 0, {1, 0}, {4, 1999}), StatusError);
  for (const auto end = Clock::now() + 60s; index->snapshot().overlay == map.overlay && Clock::now() < end;)
    std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  for (const auto end = Clock::now() + 60s; !index->snapshot().overlay && Clock::now() < end;)
    std::this_thread::sleep_for(1ms);
  expect_as_dijkstra(index->snapshot(), 0, {1, 0}, {4, 1999});
}

// A run continues with the cells of the run before if the map is the same and nothing is damaged.
TEST(RouteIndexFile, IsKeptAfterARunThatEndsInOrder) {
  const storage::TemporaryFolder temporary;
  const std::string folder = temporary / "map";
  std::filesystem::create_directory(folder);
  LiveTown town;
  town.drive(2000);
  std::mt19937 random(6);
  const auto ask = [&](const RouteIndex& index) {
    for (int i = 0; i < 20; ++i)
      expect_as_dijkstra(index.snapshot(), random() % kTownMetrics.size(), town.random_frame(random),
                         town.random_frame(random));
  };
  const auto inode = [&] {
    struct stat info {};
    EXPECT_EQ(::stat((folder + "/routes/cells").c_str(), &info), 0);
    return info.st_ino;
  };
  const auto await = [&](const RouteIndex& index) {
    ASSERT_TRUE(index.wait_current(Clock::now() + 60s));
    ASSERT_TRUE(index.snapshot().overlay);
  };
  {
    const auto index = town.index(folder);
    index->start();
    await(*index);
    index->stop();
    for (int i = 0; i < 5; ++i) town.change(random);  // after which the cells are stale
    town.drive(100);
    ASSERT_TRUE(town.map().commit().ok());
    ASSERT_TRUE(index->save().ok());
    EXPECT_FALSE(index->snapshot().stale.empty());
  }
  const auto first = inode();
  const auto held_open = std::ifstream(folder + "/routes/cells");  // keeps its inode from being reused
  {
    const auto index = town.index(folder);
    index->start();
    while (!index->snapshot().overlay) std::this_thread::sleep_for(1ms);
    ask(*index);
    await(*index);
    ask(*index);
    EXPECT_EQ(inode(), first) << "they are the same cells";
    for (int i = 0; i < 5; ++i) town.change(random);
    await(*index);
    ask(*index);
    index->stop();
    ASSERT_TRUE(town.map().commit().ok());
    ASSERT_TRUE(index->save().ok());
  }
  town.map().watch_edits({});
  town.change(random);  // without telling the index
  ASSERT_TRUE(town.map().commit().ok());
  {
    const auto index = town.index(folder);
    index->start();
    await(*index);
    ask(*index);
    EXPECT_NE(inode(), first) << "the map was another";
    index->stop();
    ASSERT_TRUE(index->save().ok());
  }
  for (const std::size_t byte : {5u, 20u, 700u}) {
    const auto before = inode();
    const auto held = std::ifstream(folder + "/routes/cells");
    std::fstream table(folder + "/routes/table", std::ios::in | std::ios::out | std::ios::binary);
    table.seekp(static_cast<std::streamoff>(byte));
    table.put('?');
    table.close();
    const auto index = town.index(folder);
    index->start();
    await(*index);
    ask(*index);
    EXPECT_NE(inode(), before) << "byte " << byte;
    index->stop();
    ASSERT_TRUE(index->save().ok());
  }
  const auto last = inode();
  const auto held = std::ifstream(folder + "/routes/cells");
  for (int run = 0; run < 2; ++run) {
    const auto index = town.index(folder);
    index->start();
    await(*index);
    EXPECT_EQ(inode() == last, run == 0) << "the second follows a crash";
  }
}

TEST(RouteIndex, HasNoCellsOnAFullDisk) {
  const storage::TemporaryFolder temporary;
  const std::string folder = temporary / "map";
  std::filesystem::create_directory(folder);
  LiveTown town;
  town.drive(500);
  town.room_for_others = std::uint64_t{1} << 62;
  const auto index = town.index(folder);
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  const auto map = index->snapshot();
  EXPECT_FALSE(map.overlay);
  EXPECT_NE(map.missing_because.find("disk"), std::string::npos) << map.missing_because;
  EXPECT_EQ(std::filesystem::file_size(folder + "/routes/cells"), 0u);
  std::mt19937 random(3);
  town.change(random);
}

TEST(RouteIndex, GrowsFromAnEmptyMap) {
  LiveTown town;
  const auto index = town.index();
  index->start();
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  for (int i = 0; i < 10; ++i) {
    town.drive(40);
    expect_as_dijkstra(index->snapshot(), 0, {1, 0}, {1, static_cast<std::uint32_t>(40 * i)});
  }
  ASSERT_TRUE(index->wait_current(Clock::now() + 60s));
  expect_as_dijkstra(index->snapshot(), 0, {1, 0}, {4, 399});
}

TEST(RouteIndex, CanBeStoppedWhileItWorks) {
  LiveTown town;
  town.drive(3000);
  for (int i = 0; i < 5; ++i) {
    const auto index = town.index();
    index->start();
    std::this_thread::sleep_for(std::chrono::milliseconds(7 * i));
    town.map().watch_edits({});
  }
  EXPECT_EQ(town.budget().used(storage::Share::kRoutes), 0u);
}

}  // namespace
}  // namespace relmap::route
