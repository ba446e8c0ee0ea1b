// What the keeper of layouts does when a daemon refuses it, gives way to another one, or has nothing to draw.
#include "tools/console/layout/layout_keeper.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "storage/testing/temporary_folder.h"
#include "tests/support/patience.h"
#include "tools/console/layout/layout_file.h"
#include "tools/console/layout/testing/fake_map.h"

namespace relmap::console {
namespace {

using relmap::testing::kPatience;
using testing::FakeMap;
using testing::FakeState;

bool comes(const std::function<bool()>& true_soon) {
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (!true_soon()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

KeeperOptions often(KeptClient::Connect connect) {
  KeeperOptions options;
  options.connect = std::move(connect);
  options.poll = std::chrono::milliseconds(10);
  return options;
}

std::uint64_t version_shown(const LayoutKeeper& keeper) {
  const auto layout = keeper.state().layout;
  return layout ? layout->map_version : 0;
}

TEST(LayoutKeeper, ConnectsWithOtherCredentialsOnceItsOwnAreRefused) {
  for (const Reason reason : {Reason::UNAUTHENTICATED, Reason::NOT_ALLOWED}) {
    SCOPED_TRACE(reason_name(reason));
    FakeMap daemon;
    Mutex mutex;
    std::string let_in = "anna";  // last
    LayoutKeeper keeper(often([&] {
      const MutexLock lock(mutex);
      return daemon.connect(let_in);
    }));
    ASSERT_TRUE(comes([&] { return version_shown(keeper) == 1; }));
    daemon.change([&](FakeState& state) {
      state.refused["anna"] = reason;
      ++state.map_version;
    });
    ASSERT_TRUE(comes([&] { return keeper.state().error.reason() == reason; }));
    EXPECT_EQ(version_shown(keeper), 1u) << "what is there stays served";
    {
      const MutexLock lock(mutex);
      let_in = "berta";
    }
    EXPECT_TRUE(comes([&] { return version_shown(keeper) == 2; }));
    EXPECT_TRUE(comes([&] { return keeper.state().error.ok(); }));
  }
}

// A layout of the one map that has the other's name would be kept on disk, and shown after the next start.
TEST(LayoutKeeper, NeverTakesAnotherMapThatCameMeanwhileForTheFirst) {
  FakeMap daemon;
  const storage::TemporaryFolder cache;
  const MapIdentity first = daemon.state().map, second{Uuid::random(), 1};
  daemon.before_skeleton([&](FakeState& state) {
    state.map = second;
    state.boot_id = "another";
    state.drawn = 30;
  });
  {
    KeeperOptions options = often([&] { return daemon.connect(); });
    options.cache_folder = cache / "layouts";
    LayoutKeeper keeper(options);
    ASSERT_TRUE(comes([&] { return keeper.state().layout != nullptr; }));
    EXPECT_EQ(keeper.state().layout->map, second);
    EXPECT_EQ(keeper.state().layout->boot_id, "another");
    EXPECT_EQ(keeper.state().layout->frames, 30u);
  }
  EXPECT_TRUE(std::filesystem::exists(layout_file(cache / "layouts", second)));
  EXPECT_FALSE(std::filesystem::exists(layout_file(cache / "layouts", first)));
}

TEST(LayoutKeeper, ReadsAMapOfWhichNothingIsDrawnOncePerVersion) {
  FakeMap daemon;
  daemon.change([](FakeState& state) { state.drawn = 0; });
  LayoutKeeper keeper(often([&] { return daemon.connect(); }));
  ASSERT_TRUE(comes([&] { return keeper.state().empty.reason() == Reason::EMPTY_MAP; }));
  const auto asked_again = [&, before = daemon.statuses()] { return daemon.statuses() > before + 100; };
  ASSERT_TRUE(comes(asked_again));
  EXPECT_EQ(daemon.skeletons(), 1);
  daemon.change([](FakeState& state) {
    state.drawn = 20;
    ++state.map_version;
  });
  ASSERT_TRUE(comes([&] { return version_shown(keeper) == 2; }));
  EXPECT_TRUE(keeper.state().empty.ok());
  // What was drawn is deleted: nothing of it stays.
  daemon.change([](FakeState& state) {
    state.drawn = 0;
    ++state.map_version;
  });
  ASSERT_TRUE(comes([&] { return keeper.state().empty.reason() == Reason::EMPTY_MAP; }));
  EXPECT_EQ(keeper.state().layout, nullptr);
}

}  // namespace
}  // namespace relmap::console
