#include "server/rpc/token_keeper.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "storage/engine/memory_engine.h"

namespace relmap::rpc {
namespace {

struct Kept {};
bool is_cut_off(const Kept&) { return false; }

TEST(TokenKeeper, LetsGoOfWhatWasSentToItsEnd) {
  TokenKeeper<Kept> keeper("boot", "list", 8, std::chrono::seconds(0));
  const auto first = std::make_shared<const Kept>(), second = std::make_shared<const Kept>();
  const std::string token = keeper.token(1, first, "a"), other = keeper.token(2, second, "b");
  keeper.end(1);
  EXPECT_EQ(keeper.open(token).reason(), Reason::VIEW_EXPIRED);
  EXPECT_EQ(keeper.open(other).or_throw().position, "b");
  EXPECT_EQ(first.use_count(), 1);
}

// Whoever never comes back for the rest of a list must not keep the memory of the map's old versions.
TEST(TokenKeeper, LetsAViewThatWasCutOffGo) {
  constexpr std::uint32_t kStored = 100;
  const auto engine = storage::make_memory_engine();
  const auto budget = std::make_shared<storage::Budget>(std::size_t{2} << 20);
  const auto map = storage::Map::open(engine, engine->acquire().value(), budget).value();
  storage::Session session;
  session.number = 1;
  map->add_session(session);
  for (std::uint32_t i = 0; i < kStored; ++i) {
    storage::FrameHot hot;
    hot.present = true;
    hot.landmarks.resize(10);
    map->add_frame({1, i}, hot, {}, {});
  }
  ASSERT_TRUE(map->commit().ok());

  ViewKeeper keeper("boot");
  const std::string token = keeper.token(map->view(), "position");
  EXPECT_EQ(keeper.open(token, nullptr).or_throw().position, "position");
  std::vector<std::shared_ptr<const storage::MapView>> others;  // of readers that came later
  while (budget->used(storage::Share::kViews) <= budget->allowance(storage::Share::kViews)) {
    for (std::uint32_t i = 0; i < kStored; ++i) map->edit_hot({1, i}).mean_error = static_cast<float>(others.size());
    others.push_back(map->publish());
  }
  EXPECT_EQ(keeper.open(token, nullptr).reason(), Reason::VIEW_EXPIRED);
  others.clear();
  EXPECT_EQ(budget->used(storage::Share::kViews), 0u);
}

}  // namespace
}  // namespace relmap::rpc
