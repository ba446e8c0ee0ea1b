#include "server/map/camera_doubts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relmap::map {
namespace {

using ::testing::ElementsAre;

void contradict(CameraDoubts& doubts, SessionNumber session, SessionNumber with, int times = 3) {
  for (int i = 0; i < times; ++i) doubts.contradict(session, with, "a focal length 10 % longer");
}
void confirm(CameraDoubts& doubts, SessionNumber session, SessionNumber with, int times = 3) {
  for (int i = 0; i < times; ++i) doubts.confirm(session, with);
}
std::vector<SessionNumber> named(const CameraDoubts& doubts) {
  std::vector<SessionNumber> sessions;
  for (const CameraDoubt& doubt : doubts.doubts()) sessions.push_back(doubt.session);
  return sessions;
}

TEST(CameraDoubts, ASessionIsInDoubtOnceThreeKeyframesContradictIt) {
  CameraDoubts doubts;
  EXPECT_FALSE(doubts.contradict(4, 2, "10 % longer"));
  EXPECT_FALSE(doubts.contradict(4, 2, "10 % longer"));
  EXPECT_THAT(named(doubts), ElementsAre());
  const auto told = doubts.contradict(4, 2, "9 % longer");
  ASSERT_TRUE(told);
  EXPECT_EQ(told->session, 4u) << "the newer one, as long as nothing else is known";
  EXPECT_THAT(told->against, ElementsAre(2));
  EXPECT_EQ(told->contradicted, 3u);
  EXPECT_EQ(told->message, "9 % longer");
  EXPECT_FALSE(doubts.contradict(4, 2, "10 % longer")) << "told once";
}

TEST(CameraDoubts, OtherSessionsTellWhichOfTwoIsWrong) {
  CameraDoubts doubts;
  contradict(doubts, 2, 1);
  contradict(doubts, 3, 1);
  confirm(doubts, 3, 2);
  EXPECT_THAT(named(doubts), ElementsAre(1));
  EXPECT_THAT(doubts.doubts()[0].against, ElementsAre(2, 3));
  EXPECT_EQ(doubts.doubts()[0].contradicted, 6u);
}

TEST(CameraDoubts, TwoWrongOnesAreBothNamed) {
  CameraDoubts doubts;
  for (const SessionNumber wrong : {2u, 5u})
    for (const SessionNumber right : {1u, 3u, 4u}) contradict(doubts, wrong, right);
  confirm(doubts, 3, 1);
  confirm(doubts, 4, 1);
  confirm(doubts, 4, 3);
  EXPECT_THAT(named(doubts), ElementsAre(2, 5));
}

TEST(CameraDoubts, SessionsConfirmedMoreOftenThanContradictedAreNotInDoubt) {
  CameraDoubts doubts;
  contradict(doubts, 4, 1);
  confirm(doubts, 4, 1);
  EXPECT_THAT(named(doubts), ElementsAre(4));
  confirm(doubts, 1, 4, 1);
  EXPECT_THAT(named(doubts), ElementsAre());
}

// A wrong calibration fits what was seen with it.
TEST(CameraDoubts, ASessionDoesNotConfirmItself) {
  CameraDoubts doubts;
  contradict(doubts, 4, 1);
  confirm(doubts, 4, 4, 300);
  EXPECT_THAT(named(doubts), ElementsAre(4));
  CameraDoubts own;
  contradict(own, 7, 7);
  EXPECT_THAT(named(own), ElementsAre(7)) << "it may contradict itself";
}

TEST(CameraDoubts, WhatIsDeletedIsForgotten) {
  CameraDoubts doubts;
  contradict(doubts, 4, 1);
  contradict(doubts, 7, 6);
  doubts.forget(4);
  EXPECT_THAT(named(doubts), ElementsAre(7));
}

}  // namespace
}  // namespace relmap::map
