#include "tools/console/browser_sessions.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace relmap::console {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using Time = BrowserSessions::Clock::time_point;

const Time kStart{hours(1000)};

TEST(BrowserSessions, StandForATokenUntilTheyEnd) {
  BrowserSessions sessions;
  const std::string id = sessions.begin("token", kStart), other = sessions.begin("token", kStart);
  EXPECT_EQ(id.size(), 64u);
  EXPECT_NE(id, other);
  EXPECT_EQ(sessions.use(id, kStart), "token");
  EXPECT_EQ(sessions.use("token", kStart), std::nullopt);
  EXPECT_EQ(sessions.use("", kStart), std::nullopt);
  sessions.end(id);
  EXPECT_EQ(sessions.use(id, kStart), std::nullopt);
  EXPECT_EQ(sessions.use(other, kStart), "token");
  sessions.end_all_of("token");
  EXPECT_EQ(sessions.use(other, kStart), std::nullopt);
  EXPECT_EQ(sessions.size(), 0u);
}

TEST(BrowserSessions, EndWhenNobodyUsesThem) {
  BrowserSessions sessions;
  const std::string id = sessions.begin("token", kStart);
  EXPECT_EQ(sessions.use(id, kStart + hours(11)), "token");
  EXPECT_EQ(sessions.newest(kStart + hours(22)), "token");
  EXPECT_EQ(sessions.use(id, kStart + hours(22)), "token");
  EXPECT_EQ(sessions.newest(kStart + hours(34) + minutes(1)), std::nullopt);
  EXPECT_EQ(sessions.use(id, kStart + hours(34) + minutes(1)), std::nullopt);
  EXPECT_EQ(sessions.size(), 0u);
}

TEST(BrowserSessions, WhoLogsInTooOftenEndsHisOwn) {
  BrowserSessions sessions(BrowserSessions::Limits{.most = 4});
  const std::string anna = sessions.begin("anna", kStart);
  const std::string first = sessions.begin("bert", kStart + minutes(1));
  for (int i = 2; i < 100; ++i) sessions.begin("bert", kStart + minutes(i));
  EXPECT_EQ(sessions.size(), 4u);
  EXPECT_EQ(sessions.use(anna, kStart + minutes(100)), "anna") << "though it was not used for longest";
  EXPECT_EQ(sessions.use(first, kStart + minutes(100)), std::nullopt);
  // One more, who has none yet: that which was not used for longest.
  sessions.begin("carl", kStart + minutes(101));
  EXPECT_EQ(sessions.use(anna, kStart + minutes(101)), "anna");
  EXPECT_EQ(sessions.newest(kStart + minutes(101)), "carl");
}

TEST(BrowserSessions, TheNewestIsTheOneThatBeganLast) {
  BrowserSessions sessions;
  EXPECT_EQ(sessions.newest(kStart), std::nullopt);
  const std::string anna = sessions.begin("anna", kStart), bert = sessions.begin("bert", kStart);
  EXPECT_EQ(sessions.use(anna, kStart + minutes(1)), "anna");
  EXPECT_EQ(sessions.newest(kStart + minutes(1)), "bert") << "however often others ask";
  sessions.end(bert);
  EXPECT_EQ(sessions.newest(kStart + minutes(1)), "anna");
}

}  // namespace
}  // namespace relmap::console
