#include "frontend/workflow/held_back.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "frontend/workflow/testing/workflow_fixture.h"

namespace relmap::workflow {
namespace {

class HeldBackTest : public WorkflowTest {
 protected:
  Keyframe next_keyframe() {
    Keyframe keyframe;
    keyframe.session = delivery_->session();
    keyframe.sequence = next_++;
    return keyframe;
  }

  std::uint32_t next_ = 0;
  workflow::Run run_{options_, outside_, stop_, summary_, waits_};
  std::unique_ptr<Delivery> delivery_ = Delivery::open(run_, session_called("street"), "street").or_throw();
  HeldBack held_back_{*delivery_, summary_};
};

TEST_F(HeldBackTest, PassesKeyframesOnInOrderOnceAPairIsTrackedFromAnother) {
  summary_.tracked = 1;
  ASSERT_TRUE(held_back_.push(next_keyframe()).ok());
  ASSERT_TRUE(held_back_.push(next_keyframe()).ok());
  EXPECT_EQ(daemon_.pushed.size(), 0u);
  summary_.tracked = 2;
  ASSERT_TRUE(held_back_.push(next_keyframe()).ok());
  ASSERT_EQ(daemon_.pushed.size(), 3u);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(daemon_.pushed[i].sequence, i);
}

TEST_F(HeldBackTest, ReleasesTheKeyframeOfASinglePair) {
  summary_.tracked = 1;
  ASSERT_TRUE(held_back_.push(next_keyframe()).ok());
  ASSERT_TRUE(held_back_.release().ok());
  EXPECT_EQ(daemon_.pushed.size(), 1u);
  ASSERT_TRUE(held_back_.release().ok());
  EXPECT_EQ(daemon_.pushed.size(), 1u) << "each once";
}

TEST_F(HeldBackTest, FailsWhenTheMaximumIsHeld) {
  summary_.tracked = 1;
  summary_.pairs = 300;
  for (std::size_t i = 1; i < kMaxHeldBack; ++i) ASSERT_TRUE(held_back_.push(next_keyframe()).ok()) << i;
  const Status full = held_back_.push(next_keyframe());
  EXPECT_EQ(full.reason(), Reason::TOO_FEW_FEATURES);
  EXPECT_TRUE(full.message().starts_with("none of the first 300 pairs could be tracked")) << full.message();
  EXPECT_EQ(daemon_.pushed.size(), 0u);
}

TEST_F(HeldBackTest, ReturnsTheRefusalOfTheDaemon) {
  daemon_.takes = 0;
  daemon_.refuses_to_push = {Reason::SESSION_DELETED, "by its operator"};
  summary_.tracked = 2;
  EXPECT_EQ(held_back_.push(next_keyframe()).reason(), Reason::SESSION_DELETED);
}

}  // namespace
}  // namespace relmap::workflow
