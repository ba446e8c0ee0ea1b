// The console's layouts of a city of known shape, through a daemon: they follow the map, outlast the console and the
// daemon, and show every keyframe where it is.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "client/skeleton_relaxation.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/patience.h"
#include "tests/support/running_daemon.h"
#include "tests/support/skeleton_city.h"
#include "tools/console/layout/health_samples.h"
#include "tools/console/layout/layout_file.h"
#include "tools/console/layout/layout_keeper.h"
#include "tools/console/layout/local_layout.h"
#include "tools/console/layout/make_layout.h"
#include "tools/console/layout/testing/decode_tile.h"
#include "tools/console/layout/tile_maker.h"

namespace relmap::testing {
namespace {

using console::LayoutKeeper;
using console::MapLayout;
using nlohmann::json;

constexpr std::uint32_t kSessions = 4, kFrames = 1000;

class ConsoleLayout : public ::testing::Test {
 protected:
  static SkeletonCity city() {
    SkeletonCity city;
    city.frames = kSessions * kFrames;
    city.frames_per_session = kFrames;
    city.streets = 4;
    return city;
  }
  void SetUp() override {
    build_city_folder(city(), map_folder());
    start_daemon();
  }
  void start_daemon() {
    daemon = std::make_unique<RunningDaemon>(DaemonOptions{.data = map_folder(), .lcm = "", .more = {}});
  }
  std::string map_folder() const { return folder / "map"; }
  console::KeeperOptions options() {
    console::KeeperOptions options;
    options.connect = [this] { return client::Client::connect(map_folder()); };
    options.cache_folder = folder / "cache";
    options.poll = std::chrono::milliseconds(50);
    options.log = [this](const std::string& line) {
      const std::lock_guard lock(told_mutex);
      told.push_back(line);
    };
    return options;
  }
  // Waits until the state is as wanted, and returns it.
  static json wait_for(LayoutKeeper& keeper, const std::function<bool(const json&)>& wanted) {
    const auto until = std::chrono::steady_clock::now() + kPatience;
    json state = json::parse(keeper.state_json());
    while (!wanted(state) && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      state = json::parse(keeper.state_json());
    }
    EXPECT_TRUE(wanted(state)) << state.dump();
    return state;
  }
  static bool whole(const json& state) {
    return state["version"] != 0 && state["coarse"] == false && state["behind"] == 0 && state["error"].is_null();
  }
  // A robot that drove straight on, and knows nothing of the city.
  void import_drive(const std::string& robot, std::uint32_t frames) {
    client::GraphPiece piece;
    piece.session = Uuid::random();
    piece.robot = piece.name = robot;
    for (std::uint32_t k = 0; k < frames; ++k) {
      client::GraphPiece::Frame& frame = piece.frames.emplace_back();
      frame.T_odom_frame.t = {0, 0, 0.5 * k};
      frame.step_covariance = Matrix6(1e-4 * Matrix6::Identity());
      frame.time_us = 1'700'000'000'000'000 + 100'000 * std::int64_t{k};
      frame.driven_us = 100'000;
    }
    EXPECT_TRUE(daemon->client()->import_graph(piece).ok());
  }

  storage::TemporaryFolder folder;
  std::mutex told_mutex;
  std::vector<std::string> told;
  std::unique_ptr<RunningDaemon> daemon;
};

TEST_F(ConsoleLayout, FollowsTheMap) {
  LayoutKeeper keeper(options());
  const json first = wait_for(keeper, whole);
  EXPECT_EQ(first["frames"], kSessions * kFrames);
  EXPECT_EQ(first["level"], 3);
  EXPECT_EQ(first["points"], kSessions * kFrames);
  EXPECT_TRUE(first["empty"].is_null());
  EXPECT_EQ(first["parts"][0]["sessions"].size(), kSessions);
  EXPECT_GT(first["time"]["last_ms"].get<std::int64_t>(), first["time"]["first_ms"].get<std::int64_t>());
  const std::shared_ptr<const MapLayout> before = keeper.state().layout;

  // It has the city's shape.
  std::map<SessionNumber, std::vector<SE3>> ways;
  for (SessionNumber session = 1; session <= kSessions; ++session) ways[session] = true_way(city(), session);
  std::vector<double> errors;
  for (std::uint32_t k = 0; k < 2000; ++k) {
    const FrameId a{1 + k % kSessions, k * 7 % kFrames}, b{1 + k / 3 % kSessions, k * 11 % kFrames};
    const double apart = (before->place(a)->position - before->place(b)->position).head<2>().norm();
    errors.push_back(std::abs(apart - (ways.at(a.session)[a.index].t - ways.at(b.session)[b.index].t).norm()));
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 2) << "metres";

  import_drive("new", 30);
  const json second =
      wait_for(keeper, [&](const json& state) { return whole(state) && state["frames"] == kSessions * kFrames + 30; });
  EXPECT_GT(second["version"], first["version"]);
  EXPECT_EQ(second["parts"].size(), first["parts"].size() + 1);
  const std::shared_ptr<const MapLayout> after = keeper.state().layout;
  for (std::uint32_t k = 0; k < kFrames; k += 50)
    EXPECT_LT((before->place({2, k})->position - after->place({2, k})->position).norm(), 0.5) << "nothing jumps";

  // Tiles of both, and from the one to the other.
  EXPECT_TRUE(keeper.tile({before->version, {0, 0, 0}}).or_throw());
  const auto eased = keeper.tile({after->version, {0, 0, 0}, before->version}).or_throw();
  ASSERT_TRUE(eased);
  EXPECT_TRUE(console::testing::decode_tile(*eased)->flags & console::Tile::kHasOld);
  EXPECT_EQ(keeper.tile({77, {0, 0, 0}}).reason(), Reason::VIEW_EXPIRED);
  EXPECT_EQ(keeper.tile({after->version, {0, 0, 0}, 77}).reason(), Reason::VIEW_EXPIRED);

  const json places = json::parse(keeper.places_json(R"({"frames": ["1:5", "9:9999", "2:7"]})").or_throw());
  EXPECT_EQ(places["version"], after->version);
  ASSERT_EQ(places["places"].size(), 3u);
  EXPECT_EQ(places["places"][0]["frame"], "1:5");
  EXPECT_NEAR(places["places"][0]["x"], after->place({1, 5})->position.x(), 1e-9);
  EXPECT_TRUE(places["places"][1].is_null());
  for (const char* bad : {"", "[]", R"({"frames": 1})", R"({"frames": ["x"]})", R"({"frames": [1]})"})
    EXPECT_EQ(keeper.places_json(bad).reason(), Reason::INVALID_ARGUMENT) << bad;
}

TEST_F(ConsoleLayout, OutlastsTheConsoleAndTheDaemon) {
  std::uint64_t version = 0;
  {
    LayoutKeeper keeper(options());
    version = wait_for(keeper, whole)["version"];
    EXPECT_EQ(daemon->stop(), 0);
    // A call that was under way may have ended otherwise at first.
    const json lost = wait_for(keeper, [](const json& state) {
      return !state["error"].is_null() && state["error"]["reason"] == "UNREACHABLE";
    });
    EXPECT_EQ(lost["version"], version) << "what is there stays served";
    EXPECT_TRUE(keeper.tile({version, {0, 0, 0}}).or_throw());
    start_daemon();
    EXPECT_EQ(wait_for(keeper, whole)["frames"], kSessions * kFrames);
    version = keeper.state().layout->version;
  }
  // Another console starts with it.
  LayoutKeeper keeper(options());
  const json first = wait_for(keeper, [](const json& state) { return state["version"] != 0; });
  EXPECT_GE(first["version"], version);
  EXPECT_TRUE(keeper.tile({version, {0, 0, 0}}).ok()) << "as it was on disk";
  EXPECT_GE(wait_for(keeper, whole)["version"], version);
}

TEST_F(ConsoleLayout, ADamagedFileIsToldAndMadeAnew) {
  std::string file;
  {
    LayoutKeeper keeper(options());
    wait_for(keeper, whole);
    file = console::layout_file(folder / "cache", keeper.state().layout->map);
  }
  ASSERT_TRUE(std::filesystem::exists(file));
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  {
    LayoutKeeper keeper(options());
    wait_for(keeper, whole);
  }
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("cut off"), std::string::npos) << told[0];
  EXPECT_TRUE(console::decode_layout(as_bytes([&] {
                static std::string bytes;
                std::ifstream in(file, std::ios::binary);
                bytes.assign(std::istreambuf_iterator<char>(in), {});
                return std::string_view(bytes);
              }()))
                  .ok());
}

TEST_F(ConsoleLayout, ALargeMapIsDrawnCoarselyFirst) {
  console::KeeperOptions coarse = options();
  coarse.coarse_above = 100;
  LayoutKeeper keeper(coarse);
  std::vector<std::string> steps;
  const json state = wait_for(keeper, [&](const json& now) {
    if (now["progress"].is_object()) steps.push_back(now["progress"]["step"]);
    EXPECT_TRUE(now["version"] == 0 || now["coarse"] == (now["level"] == 0));
    return whole(now);
  });
  EXPECT_EQ(state["level"], 3);
  EXPECT_TRUE(state["progress"].is_null() || state["progress"]["step"] == "reading");
  for (const std::string& step : steps)
    EXPECT_TRUE(step == "reading" || step == "relaxing" || step == "drawing") << step;
}

TEST_F(ConsoleLayout, AnEmptyMapSaysSo) {
  EXPECT_EQ(daemon->stop(), 0);
  std::filesystem::remove_all(map_folder());
  start_daemon();
  LayoutKeeper keeper(options());
  const json state = wait_for(keeper, [](const json& now) { return !now["empty"].is_null(); });
  EXPECT_EQ(state["empty"]["reason"], "EMPTY_MAP");
  EXPECT_EQ(state["version"], 0);
  EXPECT_EQ(keeper.places_json(R"({"frames": []})").reason(), Reason::VIEW_EXPIRED);
  import_drive("first", 20);
  EXPECT_EQ(wait_for(keeper, whole)["frames"], 20);
}

// Beyond what the layout has, tiles have every keyframe, where the layout of every frame has it, but for what bends
// between points.
TEST_F(ConsoleLayout, DrawsEveryKeyframeFromNearby) {
  const auto client = daemon->client();
  const auto skeleton = client->skeleton({.level = 0, .candidates = true}).or_throw();
  auto layout =
      std::make_shared<MapLayout>(console::make_layout(skeleton, client::relax_skeleton(skeleton).or_throw(), nullptr));
  layout->version = 1;
  layout->zooms = 2;
  ASSERT_LT(layout->points.size(), kSessions * kFrames / 2);
  console::KeyframeLines lines(64u << 20, std::chrono::milliseconds(0));
  const console::ClientOf client_of = [&] { return Result(std::shared_ptr<client::Client>(daemon->client())); };
  const auto of = lines.of(*layout, {1, 2, 3, 4}, client_of).or_throw();
  const auto again = lines.of(*layout, {2}, client_of).or_throw();
  EXPECT_EQ(of.at(2), again.at(2)) << "kept";

  const console::TileIndex index(layout);
  std::map<FrameId, Vector2> seen;
  const std::uint32_t zoom = layout->zooms + 1;
  for (std::uint32_t x = 0; x < console::TileIndex::tiles(zoom); ++x)
    for (std::uint32_t y = 0; y < console::TileIndex::tiles(zoom); ++y) {
      const auto tile = console::make_tile(index, {zoom, x, y}, {nullptr, nullptr, &of});
      for (std::size_t r = 0; r < tile.runs.size(); ++r) {
        const std::size_t end = r + 1 < tile.runs.size() ? tile.runs[r + 1].first : tile.vertices.size();
        for (std::size_t k = tile.runs[r].first; k < end; ++k) {
          const auto& v = tile.vertices[k];
          if (v.flags & console::kCut) continue;
          const Vector2 at(tile.origin_x + tile.unit * v.x, tile.origin_y + tile.unit * v.y);
          const auto [known, fresh] = seen.emplace(FrameId{tile.runs[r].session, v.index}, at);
          EXPECT_LT((known->second - at).norm(), 0.01);
        }
      }
    }
  EXPECT_EQ(seen.size(), kSessions * kFrames);
  // Steps are as the robots drove them: a metre, but for what the layout bends.
  std::vector<double> off;
  for (const auto& [frame, at] : seen)
    if (const auto next = seen.find({frame.session, frame.index + 1}); next != seen.end())
      off.push_back(std::abs((next->second - at).norm() - 1));
  std::sort(off.begin(), off.end());
  EXPECT_LT(off[off.size() / 2], 0.1);
  EXPECT_LT(off[off.size() * 99 / 100], 0.5);
}

TEST_F(ConsoleLayout, HasSmallLayoutsAroundClosures) {
  const auto client = daemon->client();
  client::EdgeFilter filter;
  filter.states = {client::EdgeState::kAccepted};
  filter.kinds = {client::EdgeKind::kLoop};
  filter.limit = 3;
  const auto closures = client->edges(filter).or_throw();
  ASSERT_FALSE(closures.empty());
  for (const client::Edge& closure : closures) {
    const auto local = console::local_layout({closure.id, 20}, *client).or_throw();
    EXPECT_EQ(local.root, closure.a);
    EXPECT_GT(local.frames.size(), 20u);
    EXPECT_LE(local.frames.size(), console::kMaxLocalFrames);
    EXPECT_TRUE(local.with.joined);
    EXPECT_EQ(local.with.at.size(), local.frames.size());
    bool has_it = false;
    for (const auto& told_closure : local.closures)
      has_it = has_it || (told_closure.id == closure.id && told_closure.goes);
    EXPECT_TRUE(has_it);
  }
  EXPECT_EQ(console::local_layout({{{1, 5}, 0}}, *client).reason(), Reason::ODOMETRY_EDGE);
  EXPECT_EQ(console::local_layout({{{1, 5}, 99}}, *client).reason(), Reason::NO_SUCH_EDGE);
  EXPECT_EQ(console::local_layout({closures[0].id, -1}, *client).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(ConsoleLayout, SamplesHowTheDaemonDoes) {
  console::HealthOptions options;
  options.every = std::chrono::milliseconds(20);
  options.most = 5;
  options.connect = [this] { return client::Client::connect(map_folder()); };
  console::HealthSamples health(options);
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (health.samples().size() < 5 && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const json all = json::parse(health.samples_json());
  EXPECT_EQ(all["every_ms"], 20);
  ASSERT_LE(all["samples"].size(), 5u);
  const json& sample = all["samples"][0];
  EXPECT_EQ(sample["reachable"], true);
  EXPECT_EQ(sample["frames"], kSessions * kFrames);
  EXPECT_GT(sample["accepted"], 0);
  EXPECT_GT(sample["disk_bytes"], 0);
  EXPECT_GT(sample["memory_budget"], 0);
  EXPECT_EQ(daemon->stop(), 0);
  while (health.samples().back().reachable && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  health.stop();
  const json last = json::parse(health.samples_json(health.samples().back().time_ms - 1));
  EXPECT_EQ(last["samples"].back()["reachable"], false);
  EXPECT_FALSE(last["samples"].back().contains("frames"));
}

}  // namespace
}  // namespace relmap::testing
