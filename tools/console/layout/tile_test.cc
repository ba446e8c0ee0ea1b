#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <map>
#include <random>
#include <set>
#include <thread>

#include "tools/console/layout/line_importance.h"
#include "tools/console/layout/testing/decode_tile.h"
#include "tools/console/layout/testing/drawn_map.h"
#include "tools/console/layout/tile_maker.h"
#include "tools/console/layout/tile_source.h"

namespace relmap::console {
namespace {

using testing::decode_tile;
using testing::draw_layout;
using testing::draw_skeleton;
using testing::DrawnMap;

class Tiles : public ::testing::Test {
 protected:
  static std::shared_ptr<MapLayout> layout_of(std::uint32_t zooms) {
    auto layout = std::make_shared<MapLayout>(*draw_layout({}));
    layout->zooms = zooms;
    return layout;
  }
  // All tiles of a zoom, by their coordinates.
  template <typename Use>
  void each(std::uint32_t zoom, Use use) {
    for (std::uint32_t x = 0; x < TileIndex::tiles(zoom); ++x)
      for (std::uint32_t y = 0; y < TileIndex::tiles(zoom); ++y) {
        const TileId id{zoom, x, y};
        const Tile tile = make_tile(index, id);
        if (!tile.empty()) use(id, tile);
      }
  }
  Vector2 at(const Tile& tile, const Tile::Vertex& v) const {
    return Vector2(tile.origin_x, tile.origin_y) + static_cast<double>(tile.unit) * Vector2(v.x, v.y);
  }
  Vector2 true_place(SessionNumber session, const Tile::Vertex& v) const {
    return layout->place({session, v.index})->position.head<2>();
  }
  static SessionNumber session_of(const Tile& tile, std::size_t vertex) {
    SessionNumber session = 0;
    for (const Tile::Run& run : tile.runs)
      if (run.first <= vertex) session = run.session;
    return session;
  }

  std::shared_ptr<MapLayout> layout = layout_of(4);
  TileIndex index{layout};
};

TEST_F(Tiles, HaveEveryPointInTheTileThatHoldsItAtTheLastZoom) {
  std::map<FrameId, std::size_t> seen;
  each(layout->zooms, [&](const TileId& id, const Tile& tile) {
    const LayoutBox box = index.box(id);
    for (std::size_t k = 0; k < tile.vertices.size(); ++k) {
      const Tile::Vertex& v = tile.vertices[k];
      if (v.flags & kCut) continue;
      const FrameId frame{session_of(tile, k), v.index};
      const auto place = layout->place(frame);
      ASSERT_TRUE(place) << frame.to_string();
      const Vector2 p = place->position.head<2>();
      EXPECT_LT((at(tile, v) - p).cwiseAbs().maxCoeff(), 0.51 * static_cast<double>(tile.unit) + 1e-6);
      if ((p.array() >= box.low.array()).all() && (p.array() < box.high.array()).all()) ++seen[frame];
      EXPECT_EQ(v.time_s, layout->points[place->point].time_s);
      EXPECT_EQ(v.flags & kSessionEnd, layout->points[place->point].flags & kSessionEnd);
    }
  });
  for (const MapLayout::Run& run : layout->runs)
    for (std::uint32_t k = run.first; k < run.end; ++k) EXPECT_EQ(seen[layout->frame_of(run, k)], 1u);
  EXPECT_EQ(seen.size(), layout->points.size());
}

// Lines lie within the tolerance of the points that are left out, and are whole across tiles: every point is near a
// line of the tile that holds it.
TEST_F(Tiles, DrawLinesToWithinAPixel) {
  for (std::uint32_t zoom = 0; zoom <= layout->zooms + 2; ++zoom) {
    std::size_t vertices = 0;
    each(zoom, [&](const TileId& id, const Tile& tile) {
      vertices += tile.vertices.size();
      const LayoutBox box = index.box(id);
      std::map<SessionNumber, std::vector<std::pair<Vector2, Vector2>>> segments;
      for (std::size_t r = 0; r < tile.runs.size(); ++r) {
        const std::size_t end = r + 1 < tile.runs.size() ? tile.runs[r + 1].first : tile.vertices.size();
        EXPECT_LT(tile.runs[r].first, end);
        for (std::size_t k = tile.runs[r].first; k < end; ++k) {
          const Vector2 to = at(tile, tile.vertices[k]);
          segments[tile.runs[r].session].emplace_back(k > tile.runs[r].first ? at(tile, tile.vertices[k - 1]) : to, to);
          const Vector2 beyond = (box.low - to).cwiseMax(to - box.high);
          EXPECT_LE(beyond.maxCoeff(), 0.5 * box.size().x() + static_cast<double>(tile.unit));
        }
      }
      const double tolerance = index.tolerance(zoom) + static_cast<double>(tile.unit);
      for (const MapLayout::Run& run : layout->runs)
        for (std::uint32_t k = run.first; k < run.end; ++k) {
          const Vector2 p = layout->points[k].position.head<2>();
          // Near the edge the line may run in the neighbour.
          const Vector2 inside = Vector2::Constant(tolerance);
          if (!((p - inside).array() >= box.low.array()).all() || !((p + inside).array() < box.high.array()).all())
            continue;
          double nearest = 1e9;
          for (const auto& [a, b] : segments[run.session]) nearest = std::min(nearest, distance_from_segment(p, a, b));
          ASSERT_LE(nearest, tolerance) << layout->frame_of(run, k).to_string() << " at zoom " << zoom;
        }
    });
    EXPECT_TRUE(zoom != 0 || vertices < layout->points.size() / 2);
  }
}

TEST_F(Tiles, AgreeOnVerticesThatNeighboursShare) {
  for (const std::uint32_t zoom : {1u, 3u, 5u}) {
    std::map<std::pair<SessionNumber, std::uint32_t>, Vector2> seen;
    std::size_t shared = 0;
    each(zoom, [&](const TileId& id, const Tile& tile) {
      const LayoutBox box = index.box(id);
      for (std::size_t k = 0; k < tile.vertices.size(); ++k) {
        if (tile.vertices[k].flags & kCut) continue;
        const Vector2 p = at(tile, tile.vertices[k]);
        const auto [known, fresh] = seen.emplace(std::pair(session_of(tile, k), tile.vertices[k].index), p);
        if (!fresh) ++shared;
        EXPECT_LT((known->second - p).norm(), 1e-9);
      }
      EXPECT_NEAR(tile.origin_x, box.low.x() - box.size().x() / 2, 1e-9);
    });
    EXPECT_GT(shared, 10u);
  }
}

TEST_F(Tiles, HaveClosuresAtBothEnds) {
  std::map<EdgeId, std::size_t> ends;
  each(layout->zooms, [&](const TileId& id, const Tile& tile) {
    const LayoutBox box = index.box(id);
    for (const Tile::Closure& closure : tile.closures) {
      const auto a = layout->place(closure.a), b = layout->place(closure.id.frame);
      const Vector2 origin(tile.origin_x, tile.origin_y);
      EXPECT_LT((origin + Vector2(closure.a_x, closure.a_y) - a->position.head<2>()).norm(), 1e-3);
      EXPECT_LT((origin + Vector2(closure.b_x, closure.b_y) - b->position.head<2>()).norm(), 1e-3);
      for (const auto& end : {a, b}) {
        const Vector2 p = end->position.head<2>();
        ends[closure.id] += (p.array() >= box.low.array()).all() && (p.array() < box.high.array()).all();
      }
    }
  });
  EXPECT_EQ(ends.size(), layout->closures.size());
  for (const auto& [id, count] : ends) EXPECT_EQ(count, 2u) << id.to_string();

  // At a low zoom only what is doubtful or long, the most suspicious first.
  const Tile whole = make_tile(index, {0, 0, 0});
  double before = 2;
  EXPECT_TRUE(whole.closures[0].flags & Tile::kIsTorn);
  for (const Tile::Closure& closure : whole.closures) {
    const double length = std::hypot(closure.a_x - closure.b_x, closure.a_y - closure.b_y);
    const bool torn = closure.flags & Tile::kIsTorn;
    EXPECT_TRUE(torn || closure.suspicion >= kSuspicious || length > 8 * layout->size / 512);
    if (torn) continue;
    EXPECT_LE(closure.suspicion, before);
    before = closure.suspicion;
  }
}

TEST_F(Tiles, AreReadAsTheyWereWritten) {
  auto drawn = draw_skeleton({});
  for (auto& part : drawn.relaxed.parts)
    for (auto& place : part.places) place.T_root_frame.t *= 1.02;
  const MapLayout old = make_layout(drawn.skeleton, drawn.relaxed, layout.get());
  const std::vector<float> sigmas(layout->points.size(), 0.5f);
  std::size_t tiles = 0;
  for (const MapLayout* from : {static_cast<const MapLayout*>(nullptr), &old})
    for (const std::vector<float>* of : {static_cast<const std::vector<float>*>(nullptr), &sigmas})
      for (std::uint32_t zoom = 0; zoom <= layout->zooms + kMoreZooms; zoom += 2)
        for (std::uint32_t k = 0; k < TileIndex::tiles(zoom); k += 1 + TileIndex::tiles(zoom) / 8) {
          const Tile tile = make_tile(index, {zoom, k, TileIndex::tiles(zoom) / 2}, {from, of, nullptr});
          const std::string bytes = tile.encoded();
          const auto read = decode_tile(bytes);
          ASSERT_TRUE(read);
          EXPECT_EQ(*read, tile);
          EXPECT_FALSE(decode_tile(bytes + "x"));
          tiles += !tile.empty();
          for (std::size_t i = 0; i < tile.vertices.size(); ++i) {
            EXPECT_EQ(tile.vertices[i].sigma, of ? 0.5f : 0.0f);
            if (!from || (tile.vertices[i].flags & kCut)) continue;
            const Vector2 was = old.place({session_of(tile, i), tile.vertices[i].index})->position.head<2>();
            EXPECT_NEAR(tile.vertices[i].old_x + tile.origin_x, was.x(), 1e-3);
            EXPECT_NEAR(tile.vertices[i].old_y + tile.origin_y, was.y(), 1e-3);
          }
        }
  EXPECT_GT(tiles, 20u);
}

TEST_F(Tiles, HoldNoMoreThanTheirLimit) {
  auto crowded = std::make_shared<MapLayout>(*draw_layout({.parts = 1, .sessions = 20, .points = 3000, .step = 0.4}));
  ASSERT_GT(crowded->points.size(), 3 * kMaxVertices);
  crowded->zooms = 0;
  const Tile tile = make_tile(TileIndex(crowded), {0, 0, 0});
  EXPECT_LE(tile.vertices.size(), kMaxVertices);
  EXPECT_GT(tile.vertices.size(), kMaxVertices / 8);
  // By itself a layout has so many zooms that its tiles need not be drawn more coarsely.
  choose_zooms(*crowded);
  EXPECT_GT(crowded->zooms, 1u);
  const TileIndex fine(crowded);
  for (std::uint32_t x = 0; x < TileIndex::tiles(crowded->zooms); ++x)
    for (std::uint32_t y = 0; y < TileIndex::tiles(crowded->zooms); ++y)
      EXPECT_LE(fine.segments({crowded->zooms, x, y}).size(), kMaxVertices);
}

TEST_F(Tiles, AreServedByRequest) {
  TileSource source;
  const ClientOf nobody = []() -> Result<std::shared_ptr<client::Client>> {
    return {Reason::UNREACHABLE, "no daemon"};
  };
  const auto first = source.tile(index, nullptr, {layout->version, {0, 0, 0}}, nobody).or_throw();
  ASSERT_TRUE(first);
  EXPECT_EQ(source.tile(index, nullptr, {layout->version, {0, 0, 0}}, nobody).or_throw(), first) << "kept";
  EXPECT_NE(source.tile(index, nullptr, {layout->version, {0, 0, 0}, 0, FrameId{1, 50}}, nobody).or_throw(), first);
  EXPECT_EQ(source.tile(index, nullptr, {layout->version, {0, 0, 1}}, nobody).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(source.tile(index, nullptr, {layout->version, {layout->zooms + kMoreZooms + 1, 0, 0}}, nobody).reason(),
            Reason::INVALID_ARGUMENT);
  EXPECT_EQ(source.tile(index, nullptr, {layout->version, {0, 0, 0}, 0, FrameId{99, 0}}, nobody).reason(),
            Reason::NO_SUCH_FRAME);
  const std::uint32_t corner = TileIndex::tiles(layout->zooms) - 1;
  EXPECT_FALSE(source.tile(index, nullptr, {layout->version, {layout->zooms, corner, corner}}, nobody).or_throw());
  // Without the daemon, points are drawn where keyframes would be.
  const Vector2 cell = (layout->points[20].position.head<2>() - layout->corner) / index.tile_size(layout->zooms + 1);
  const TileId fine{layout->zooms + 1, static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y())};
  EXPECT_FALSE(source.tile_at_once(index, nullptr, {layout->version, fine}).or_throw());
  const auto drawn = source.tile(index, nullptr, {layout->version, fine}, nobody).or_throw();
  ASSERT_TRUE(drawn);
  EXPECT_TRUE(decode_tile(*drawn));
  // Whatever needs no daemon is there at once.
  EXPECT_EQ(source.tile_at_once(index, nullptr, {layout->version, {0, 0, 0}}).or_throw(), first);
  EXPECT_TRUE(source.tile_at_once(index, nullptr, {layout->version, {1, 0, 0}}).or_throw());
  EXPECT_TRUE(source.tile_at_once(index, nullptr, {layout->version, {0, 0, 0}, 0, FrameId{2, 50}}).or_throw());
}

// A picture has many tiles, and asks for them all at once.
TEST_F(Tiles, AskADaemonThatDoesNotAnswerOnlyOnce) {
  TileSource::Limits limits;
  limits.away = std::chrono::hours(1);
  TileSource source(limits);
  std::vector<TileId> fine;
  const std::uint32_t zoom = layout->zooms + 1;
  for (std::uint32_t k = 0; k < layout->points.size() && fine.size() < 12; k += 30) {
    const Vector2 cell = (layout->points[k].position.head<2>() - layout->corner) / index.tile_size(zoom);
    fine.push_back({zoom, static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y())});
  }
  std::atomic<int> asked{0}, drawn{0};
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  const ClientOf hangs = [&]() -> Result<std::shared_ptr<client::Client>> {
    ++asked;
    released.wait();
    return {Reason::UNREACHABLE, "no daemon"};
  };
  std::vector<std::thread> threads;
  for (const TileId& id : fine)
    threads.emplace_back([&, id] {
      if (source.tile(index, nullptr, {layout->version, id}, hangs).or_throw()) ++drawn;
    });
  while (asked == 0) std::this_thread::yield();
  // Meanwhile others do not wait.
  EXPECT_TRUE(source.tile_at_once(index, nullptr, {layout->version, {0, 0, 0}}).or_throw());
  release.set_value();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(drawn, static_cast<int>(fine.size()));
  // It is asked again once that is a while ago, and at once where the failure does not say that it is away.
  limits.away = std::chrono::milliseconds(0);
  TileSource hasty(limits);
  const ClientOf refuses = [&]() -> Result<std::shared_ptr<client::Client>> {
    ++asked;
    return {Reason::UNAUTHENTICATED, "nobody has logged in"};
  };
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(hasty.tile(index, nullptr, {layout->version, fine[0]}, hangs).or_throw());
    EXPECT_EQ(asked, 2 + i);
  }
  TileSource other;
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(other.tile(index, nullptr, {layout->version, fine[0]}, refuses).or_throw());
    EXPECT_EQ(asked, 4 + i);
  }
}

// Two robots far apart, that a guess joins: the segment goes over every column of the finest tiles.
TEST(TileIndex, ListsALongSegmentOnce) {
  MapLayout far;
  far.zooms = 16;
  far.size = 1 << 20;
  far.corner = Vector2(-7, -11);
  const std::vector<Vector2> places{{0, 0}, {1, 2}, {900'000, 400'000}, {900'001, 400'003}, {900'001, 17}, {13, 17}};
  for (const Vector2& at : places) {
    MapLayout::Point point;
    point.position.head<2>() = at;
    point.importance = 1e9f;
    point.index = static_cast<std::uint32_t>(far.points.size());
    far.points.push_back(point);
  }
  far.runs = {{1, 0, 3, 0}, {2, 3, 6, 0}};
  const TileIndex index(std::make_shared<MapLayout>(far));
  EXPECT_LT(index.size(), far.points.size() * 64 * 17);
  const auto has = [&](const TileId& tile, std::uint32_t point) {
    const auto found = index.segments(tile);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
    return std::binary_search(found.begin(), found.end(), point);
  };
  for (std::uint32_t zoom = 0; zoom <= far.zooms; ++zoom) {
    const double side = index.tile_size(zoom);
    std::mt19937 random(zoom);
    for (const std::uint32_t to : {1u, 2u, 4u, 5u}) {
      for (int i = 0; i < 100; ++i) {
        const double share = i < 2 ? i : std::generate_canonical<double, 32>(random);
        const Vector2 cell = ((1 - share) * places[to - 1] + share * places[to] - far.corner) / side;
        const TileId on{zoom, static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y())};
        EXPECT_TRUE(has(on, to)) << zoom << " " << to << " " << share;
        if (zoom < 8) continue;
        // Neither the tile well beside it, across, nor one of the corner where nothing is.
        const Vector2 along = (places[to] - places[to - 1]).normalized(),
                      beside = cell + 3 * Vector2(-along.y(), along.x());
        if (beside.minCoeff() < 0 || share == 0 || share == 1) continue;
        EXPECT_FALSE(has({zoom, static_cast<std::uint32_t>(beside.x()), static_cast<std::uint32_t>(beside.y())}, to));
      }
    }
  }
}

TEST(SingleFlight, MakesOnceWhatManyAskForAtATime) {
  SingleFlight<int, std::string> flights;
  std::atomic<int> made{0}, waiting{0};
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  const auto make = [&](const std::string& what) {
    return [&, what]() -> std::string {
      ++made;
      released.wait();
      if (what.empty()) throw StatusError({Reason::UNREACHABLE, "nobody"});
      return what;
    };
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 6; ++i)
    threads.emplace_back([&, i] {
      ++waiting;
      if (i % 2 == 0)
        EXPECT_EQ(flights.get(0, make("even")), "even");
      else
        EXPECT_THROW(flights.get(1, make("")), StatusError);
    });
  // Those of the other key do not wait for the first; its own do, or they come so late that they make it themselves.
  while (waiting < 6 || made < 2) std::this_thread::yield();
  EXPECT_EQ(made, 2);
  release.set_value();
  for (std::thread& thread : threads) thread.join();
  const int before = made;
  EXPECT_EQ(flights.get(0, make("later")), "later") << "nothing is kept";
  EXPECT_EQ(made, before + 1);
}

}  // namespace
}  // namespace relmap::console
