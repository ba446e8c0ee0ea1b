#include "server/map/camera_doubts.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

const Status kLonger{Reason::WRONG_CALIBRATION, "a focal length 10 % longer"};
const Status kShorter{Reason::WRONG_CALIBRATION, "a focal length 9 % shorter"};

TEST(CameraDoubts, ASessionIsInDoubtOnceThreeKeyframesContradictIt) {
  CameraDoubts doubts;
  EXPECT_FALSE(doubts.contradict(4, kLonger));
  EXPECT_FALSE(doubts.contradict(4, kLonger));
  EXPECT_TRUE(doubts.doubts().empty());
  EXPECT_TRUE(doubts.contradict(4, kShorter));
  EXPECT_FALSE(doubts.contradict(4, kLonger));  // told once
  const auto told = doubts.doubts();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].session, 4u);
  EXPECT_EQ(told[0].contradicted, 4u);
  EXPECT_EQ(told[0].message, kLonger.message());
}

TEST(CameraDoubts, WhatIsConfirmedMoreOftenIsNotInDoubt) {
  CameraDoubts doubts;
  doubts.confirm(4);  // before the first contradiction: not counted
  for (int i = 0; i < 3; ++i) doubts.contradict(4, kLonger);
  for (int i = 0; i < 3; ++i) doubts.confirm(4);
  ASSERT_EQ(doubts.doubts().size(), 1u);
  EXPECT_EQ(doubts.doubts()[0].confirmed, 3u);
  doubts.confirm(4);
  EXPECT_TRUE(doubts.doubts().empty());
}

TEST(CameraDoubts, SessionsAreOnTheirOwnAndForgotten) {
  CameraDoubts doubts;
  for (int i = 0; i < 2; ++i) doubts.contradict(4, kLonger);
  for (int i = 0; i < 3; ++i) doubts.contradict(7, kShorter);
  ASSERT_EQ(doubts.doubts().size(), 1u);
  EXPECT_EQ(doubts.doubts()[0].session, 7u);
  doubts.forget(7);
  EXPECT_TRUE(doubts.doubts().empty());
}

}  // namespace
}  // namespace relmap
