#include "storage/map/draft.h"

#include <gtest/gtest.h>

#include "storage/engine/memory_engine.h"

namespace relmap::storage {
namespace {

class DraftTest : public testing::Test {
 protected:
  DraftTest()
      : engine_(make_memory_engine()),
        map_(Map::open(engine_, engine_->acquire().or_throw(), std::make_shared<Budget>(std::size_t{64} << 20))
                 .or_throw()) {
    Session session;
    session.number = 1;
    map_->add_session(session);
    FrameHot hot;
    hot.present = true;
    hot.landmarks.resize(3);
    map_->add_frame(kFrame, hot, {}, {});
    map_->state().keyframes = 1;
    map_->publish();
  }

  static constexpr FrameId kFrame{1, 0};
  std::shared_ptr<Engine> engine_;
  std::unique_ptr<Map> map_;
};

TEST_F(DraftTest, WhatIsEditedIsSeenInTheDraftAndNowhereElse) {
  const auto view = map_->view();
  Draft draft(*view, view->state());
  const auto before = draft.hot(kFrame);
  draft.edit_hot(kFrame).landmarks.resize(5);
  draft.edit_warm(kFrame).observations.resize(2);
  draft.state().keyframes = 7;
  EXPECT_EQ(draft.hot(kFrame)->landmarks.size(), 5u);
  EXPECT_EQ(draft.warm(kFrame)->observations.size(), 2u);
  EXPECT_EQ(before->landmarks.size(), 3u);
  EXPECT_EQ(view->hot(kFrame)->landmarks.size(), 3u);
  EXPECT_EQ(map_->hot(kFrame)->landmarks.size(), 3u);
  EXPECT_EQ(map_->state().keyframes, 1u);
  EXPECT_EQ(draft.session(1)->number, 1u);
}

TEST_F(DraftTest, WhatIsNotEditedIsThatOfTheBase) {
  map_->set_label(kFrame, "door", true);
  FrameHot hot;
  hot.present = true;
  FrameCold cold;
  cold.picture = {1, 2, 3};
  map_->add_frame({1, 1}, hot, {}, cold);
  map_->skip(1, {2, 2, 3});
  map_->publish();
  const auto view = map_->view();
  const Draft draft(*view);
  EXPECT_EQ(draft.cold({1, 1})->picture, cold.picture);
  EXPECT_EQ(draft.sessions().size(), 1u);
  EXPECT_FALSE(draft.session(2));
  EXPECT_EQ(draft.labelled("door"), std::vector<FrameId>{kFrame});
  EXPECT_EQ(draft.labels("d"), std::vector<std::string>{"door"});
  std::uint32_t skipped = 0;
  draft.visit_skipped(1, 0, [&](const Skipped&) { return ++skipped, true; });
  EXPECT_EQ(skipped, 1u);
}

TEST_F(DraftTest, AFrameThatIsNotThereCannotBeEdited) {
  Draft draft(*map_->view());
  EXPECT_EQ(draft.hot({1, 4}), nullptr);
  EXPECT_THROW(draft.edit_hot({1, 4}), StatusError);
}

TEST_F(DraftTest, CopiesNoMoreThanItMay) {
  const auto view = map_->view();
  std::size_t asked = 0;
  Draft draft(*view, view->state(), [&](std::size_t bytes) {
    asked = bytes;
    return bytes > memory_bytes(*view->hot(kFrame)) ? Status(Reason::BUDGET_EXCEEDED, "enough") : Status();
  });
  draft.edit_hot(kFrame);
  draft.edit_hot(kFrame);
  EXPECT_EQ(asked, memory_bytes(*view->hot(kFrame))) << "once";
  EXPECT_THROW(draft.edit_warm(kFrame), StatusError);
}

}  // namespace
}  // namespace relmap::storage
