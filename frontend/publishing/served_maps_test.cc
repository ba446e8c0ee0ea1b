#include "frontend/publishing/served_maps.h"

#include <gtest/gtest.h>

#include "frontend/publishing/map_for_test.h"

namespace relmap::publishing {
namespace {

using std::chrono::milliseconds;
using testing_map::map_of;

constexpr BootId kFirst{1}, kSecond{2};

class ServedMapsTest : public testing::Test {
 protected:
  Reason status(const ServedMaps& maps) const { return maps.status(session_, now_).reason(); }

  const SessionUuid session_ = SessionUuid::random();
  ServedMaps::Time now_{std::chrono::hours(1)};
  ServedMaps maps_{{}};
};

TEST_F(ServedMapsTest, ASessionIsInTheMapOfTheFirstDaemonThatAcknowledgesIt) {
  EXPECT_TRUE(maps_.may_send(now_)) << "whoever gets it takes it in";
  maps_.introduce({kFirst, map_of(9)}, {}, now_);
  EXPECT_TRUE(maps_.introduced());
  EXPECT_FALSE(maps_.map().known());
  EXPECT_TRUE(maps_.believes(kFirst, now_));
  maps_.acknowledged_by(kFirst);
  EXPECT_EQ(maps_.map(), map_of(9));
  EXPECT_TRUE(maps_.may_send(now_));
}

TEST_F(ServedMapsTest, ADaemonMayIntroduceItselfAfterItsFirstAcknowledgement) {
  maps_.introduce({kFirst, {}}, {}, now_);
  EXPECT_TRUE(maps_.believes(kFirst, now_));
  maps_.acknowledged_by(kFirst);
  EXPECT_FALSE(maps_.map().known()) << "it has named none";
  maps_.introduce({kSecond, map_of(8)}, kFirst, now_);
  EXPECT_FALSE(maps_.map().known()) << "another's";
  maps_.introduce({kFirst, map_of(9)}, kFirst, now_);
  EXPECT_EQ(maps_.map(), map_of(9));
}

TEST_F(ServedMapsTest, ADaemonOfAnotherMapIsSentNothingAndNotBelievedWhileItIsHeard) {
  maps_.load(map_of(9));
  maps_.wait_since(now_);
  maps_.introduce({kFirst, map_of(8)}, {}, now_);
  EXPECT_TRUE(maps_.is_other(kFirst));
  EXPECT_FALSE(maps_.is_other(kSecond)) << "of which nothing is known";
  EXPECT_FALSE(maps_.believes(kFirst, now_));
  EXPECT_FALSE(maps_.introduced());
  EXPECT_EQ(status(maps_), Reason::OK) << "its own may speak yet";
  for (int second = 0; second < 10; ++second) {
    now_ += milliseconds(1000);
    maps_.introduce({kFirst, map_of(8)}, {}, now_);
    EXPECT_FALSE(maps_.may_send(now_));
  }
  EXPECT_EQ(status(maps_), Reason::WRONG_MAP);
  now_ += milliseconds(3100);
  EXPECT_EQ(status(maps_), Reason::OK) << "it has gone";
  EXPECT_TRUE(maps_.may_send(now_)) << "an old daemon may have come, which speaks only when it is spoken to";
}

TEST_F(ServedMapsTest, ADaemonOfTheSessionsMapSupersedesAnother) {
  maps_.load(map_of(9));
  maps_.introduce({kSecond, map_of(8)}, {}, now_);
  EXPECT_FALSE(maps_.may_send(now_));
  maps_.introduce({kFirst, map_of(9)}, {}, now_);
  EXPECT_TRUE(maps_.may_send(now_));
  EXPECT_TRUE(maps_.introduced());
  EXPECT_EQ(status(maps_), Reason::OK);
  EXPECT_FALSE(maps_.believes(kSecond, now_));
  EXPECT_FALSE(maps_.may_send(now_)) << "who spoke last decides";
  EXPECT_TRUE(maps_.believes(kFirst, now_));
  EXPECT_TRUE(maps_.may_send(now_));
}

TEST_F(ServedMapsTest, ADaemonThatNamesNoMapIsBelievedAfterAWhile) {
  maps_.load(map_of(9));
  EXPECT_FALSE(maps_.believes(kFirst, now_));
  EXPECT_FALSE(maps_.may_send(now_)) << "nobody has waited yet";
  maps_.wait_since(now_);
  now_ += milliseconds(2900);
  maps_.wait_since(now_);
  EXPECT_FALSE(maps_.believes(kFirst, now_));
  EXPECT_FALSE(maps_.may_send(now_));
  now_ += milliseconds(200);
  EXPECT_TRUE(maps_.may_send(now_)) << "since the first time that somebody waited";
  EXPECT_TRUE(maps_.believes(kFirst, now_));
  EXPECT_FALSE(maps_.believes(kSecond, now_)) << "each by its own time";
  maps_.acknowledged_by(kFirst);
  EXPECT_EQ(maps_.map(), map_of(9));
}

TEST_F(ServedMapsTest, ARestoredMapIsAnotherMapForRepeatableSourcesOnly) {
  maps_.load(map_of(9, 1));
  maps_.introduce({kFirst, map_of(9, 2)}, {}, now_);
  EXPECT_TRUE(maps_.believes(kFirst, now_));
  EXPECT_TRUE(maps_.restored(kFirst));
  maps_.acknowledged_by(kFirst);
  EXPECT_EQ(maps_.map(), map_of(9, 2));
  EXPECT_FALSE(maps_.restored(kFirst));

  ServedMaps again({.repeated = true});
  again.load(map_of(9, 1));
  again.introduce({kFirst, map_of(9, 2)}, {}, now_);
  EXPECT_FALSE(again.believes(kFirst, now_));
  now_ += milliseconds(2100);
  EXPECT_EQ(status(again), Reason::MAP_RESTORED);
}

TEST_F(ServedMapsTest, OverALosslessTransportTheNextDaemonIntroducesItself) {
  ServedMaps maps({.lossless = true});
  maps.load(map_of(9));
  maps.wait_since(now_);
  now_ += milliseconds(60'000);
  EXPECT_FALSE(maps.may_send(now_)) << "however long it takes";
  maps.introduce({kFirst, {}}, {}, now_);  // an old one
  EXPECT_TRUE(maps.may_send(now_));
  maps.broken();
  EXPECT_FALSE(maps.introduced());
  EXPECT_FALSE(maps.may_send(now_));
  maps.introduce({kSecond, map_of(8)}, {}, now_);
  EXPECT_EQ(status(maps), Reason::WRONG_MAP) << "at once: nobody else is heard";
  now_ += milliseconds(60'000);
  EXPECT_EQ(status(maps), Reason::WRONG_MAP) << "nor has it gone for being silent";

  maps_.introduce({kFirst, map_of(9)}, {}, now_);
  maps_.broken();
  EXPECT_TRUE(maps_.introduced()) << "of those that may be heard at the same time";
}

}  // namespace
}  // namespace relmap::publishing
