#include "tools/console/layout/map_layout.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tools/console/layout/root_sigmas.h"
#include "tools/console/layout/testing/drawn_map.h"

namespace relmap::console {
namespace {

using testing::draw_layout;
using testing::draw_skeleton;
using testing::DrawnMap;

TEST(MapLayout, HasTheShapeOfItsParts) {
  const DrawnMap map;
  const auto drawn = draw_skeleton(map);
  const MapLayout layout = make_layout(drawn.skeleton, drawn.relaxed, nullptr);
  EXPECT_EQ(layout.points.size(), drawn.skeleton.points());
  EXPECT_EQ(layout.frames, drawn.skeleton.frames);
  EXPECT_EQ(layout.map_version, 7u);
  ASSERT_EQ(layout.parts.size(), 2u);
  EXPECT_GT(layout.parts[0].frames, layout.parts[1].frames);
  EXPECT_EQ(layout.parts[0].sessions, (std::vector<SessionNumber>{1, 2, 3, 4, 5}));
  for (std::uint32_t p = 0; p < 2; ++p) {
    const auto& places = drawn.relaxed.parts[p].places;
    for (std::size_t k = 1; k < places.size(); k += 17) {
      const auto a = layout.place(places[k - 1].frame), b = layout.place(places[k].frame),
                 r = layout.place(places[0].frame);
      ASSERT_TRUE(a && b && r);
      EXPECT_EQ(layout.runs[b->run].part, p);
      const double drawn_apart = (b->position - r->position).norm();
      EXPECT_NEAR(drawn_apart, (places[k].T_root_frame.t - places[0].T_root_frame.t).norm(), 1e-6);
      // The camera looks along the way, and its x axis is to the right of it.
      const SE3 T_rb = places[0].T_root_frame.inverse() * places[k].T_root_frame;
      const double turn = std::atan2(T_rb.R(0, 2), T_rb.R(2, 2));  // to the right
      EXPECT_NEAR(std::remainder(r->heading() - b->heading() - turn, 2 * M_PI), 0, 1e-5);
      EXPECT_NEAR(std::remainder(b->heading() - b->x_axis() - M_PI / 2, 2 * M_PI), 0, 1e-5);
    }
    for (const auto& place : places) {
      const Vector2 at = layout.place(place.frame)->position.head<2>();
      EXPECT_TRUE((at.array() >= layout.parts[p].box.low.array() - 1e-9).all());
      EXPECT_TRUE((at.array() <= layout.parts[p].box.high.array() + 1e-9).all());
      EXPECT_TRUE((at.array() >= layout.corner.array()).all());
      EXPECT_TRUE((at.array() <= layout.corner.array() + layout.size).all());
    }
  }
  // Seen from above: on from the root is where it looks, and what is to its right lies to its right.
  const auto root = layout.place(drawn.relaxed.parts[0].places[0].frame);
  const auto next = layout.place(drawn.relaxed.parts[0].places[1].frame);
  const Vector2 way = (next->position - root->position).head<2>();
  EXPECT_NEAR(std::remainder(std::atan2(way.y(), way.x()) - next->heading(), 2 * M_PI), 0, 0.6);
}

TEST(MapLayout, FindsFramesBetweenPoints) {
  const auto layout = draw_layout({});
  const auto at = [&](std::uint32_t index) { return layout->place({2, index}); };
  ASSERT_TRUE(at(14) && at(15) && at(18));
  EXPECT_LT((at(15)->position - (0.75 * at(14)->position + 0.25 * at(18)->position)).norm(), 1e-9);
  EXPECT_FALSE(at(9));
  EXPECT_TRUE(at(10 + 199 * 4));
  EXPECT_FALSE(at(10 + 199 * 4 + 1));
  EXPECT_FALSE(layout->place({77, 10}));
  EXPECT_FALSE(layout->place({}));
}

TEST(MapLayout, TellsWhatIsTorn) {
  const auto layout = draw_layout({});
  ASSERT_FALSE(layout->torn.empty());
  EXPECT_NEAR(layout->torn[0].metres, 5, 0.01);
  std::size_t torn = 0;
  for (const MapLayout::Closure& closure : layout->closures) torn += closure.torn();
  EXPECT_EQ(torn, layout->torn.size());
  EXPECT_EQ(layout->torn_in_all, torn);
}

// Nothing jumps when the map grows and bends a little: the page eases from one layout to the next.
TEST(MapLayout, LiesAsTheOneBefore) {
  const DrawnMap map{.parts = 5};
  const auto before = draw_layout(map);
  auto drawn = draw_skeleton(map);
  for (auto& part : drawn.relaxed.parts) {  // another root, so that all poses are others
    const SE3 T_new_old = part.places[20].T_root_frame.inverse();
    for (auto& place : part.places) place.T_root_frame = T_new_old * place.T_root_frame;
    part.root = part.places[20].frame;
  }
  for (auto& place : drawn.relaxed.parts[1].places) place.T_root_frame.t *= 1.01;  // bent
  drawn.relaxed.parts[0].places.resize(drawn.relaxed.parts[0].places.size() - 200);
  drawn.skeleton.chains.erase(drawn.skeleton.chains.begin() + 7);  // the last session of the first part
  for (auto& part : drawn.relaxed.parts) part.places.shrink_to_fit();
  const MapLayout after = make_layout(drawn.skeleton, drawn.relaxed, before.get());
  double worst = 0;
  for (const MapLayout::Run& run : after.runs)
    for (std::uint32_t k = run.first; k < run.end; ++k) {
      const auto old = before->place(after.frame_of(run, k));
      ASSERT_TRUE(old);
      worst = std::max(worst, (old->position - after.points[k].position).norm());
    }
  EXPECT_LT(worst, 5);
  EXPECT_EQ(after.corner, before->corner);
  EXPECT_EQ(after.size, before->size);
}

TEST(MapLayout, SaysHowWellPointsAreKnownFromARoot) {
  const auto layout = draw_layout({});
  const auto sigmas = root_sigmas(*layout, {1, 50}).or_throw();
  ASSERT_EQ(sigmas.size(), layout->points.size());
  EXPECT_EQ(sigmas[layout->place({1, 50})->point], 0);
  EXPECT_GT(sigmas[layout->place({1, 54})->point], 0);
  EXPECT_GT(sigmas[layout->place({1, 90})->point], sigmas[layout->place({1, 54})->point]);
  EXPECT_TRUE(std::isinf(sigmas[layout->points.size() - 1]));  // of another part
  EXPECT_EQ(root_sigmas(*layout, {99, 1}).reason(), Reason::NO_SUCH_FRAME);
}

TEST(MapLayout, IsLean) {
  const auto layout = draw_layout({.points = 2000, .closures = 0});
  EXPECT_LE(layout->bytes(), 80 * layout->points.size());
}

}  // namespace
}  // namespace relmap::console
