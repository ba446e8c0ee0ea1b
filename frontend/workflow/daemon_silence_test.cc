#include "frontend/workflow/daemon_silence.h"

#include <gtest/gtest.h>

namespace relmap::workflow {
namespace {

using std::chrono::seconds;

const Status kUnreachable{Reason::UNREACHABLE, "nobody listens"};
const Status kOtherMap{Reason::WRONG_MAP, "another map"};
constexpr DaemonSilence::Time kStart{};

TEST(DaemonSilence, IsReportedOnceAfterItsPatienceAndSoIsItsEnd) {
  DaemonSilence silence({.daemon = "map.lab", .kept_in = "/spool"}, kStart);
  EXPECT_FALSE(silence.look(kStart + seconds(5), false, {}));
  EXPECT_EQ(silence.look(kStart + seconds(6), false, kUnreachable),
            "no relmapd has answered on map.lab (UNREACHABLE: nobody listens); keyframes wait in /spool");
  EXPECT_FALSE(silence.look(kStart + seconds(60), false, kUnreachable));
  EXPECT_EQ(silence.look(kStart + seconds(61), true, {}), "relmapd answers on map.lab");
  EXPECT_FALSE(silence.look(kStart + seconds(62), true, {}));
}

TEST(DaemonSilence, BeginsWithTheTroubleOfADaemonThatHasAnswered) {
  DaemonSilence silence({.daemon = "map.lab", .kept_in = ""}, kStart);
  EXPECT_FALSE(silence.look(kStart + seconds(30), true, {}));
  EXPECT_FALSE(silence.look(kStart + seconds(40), true, kUnreachable));
  EXPECT_FALSE(silence.look(kStart + seconds(45), true, kUnreachable));
  EXPECT_EQ(silence.look(kStart + seconds(46), true, kUnreachable),
            "relmapd does not answer any more on map.lab (UNREACHABLE: nobody listens); keyframes wait in memory");
}

TEST(DaemonSilence, IsNoneWhereTheDaemonRefuses) {
  DaemonSilence silence({.daemon = "map.lab", .kept_in = "/spool"}, kStart);
  const Status revoked{Reason::UNAUTHENTICATED, "the certificate of cart-1 was revoked"};
  EXPECT_EQ(silence.look(kStart + seconds(6), false, revoked),
            "relmapd takes nothing on map.lab (UNAUTHENTICATED: the certificate of cart-1 was revoked); keyframes wait "
            "in /spool");
}

TEST(DaemonSilence, ReportsTheWrongMapOfALiveSessionAtOnce) {
  DaemonSilence live({.daemon = "map.lab", .kept_in = "/spool", .live = true}, kStart);
  EXPECT_EQ(live.look(kStart, true, kOtherMap),
            "nothing is sent on map.lab (WRONG_MAP: another map); keyframes wait in /spool for their own map; another "
            "--session begins one in this map");
  DaemonSilence recording({.daemon = "map.lab", .kept_in = "/spool"}, kStart);
  EXPECT_FALSE(recording.look(kStart, true, kOtherMap));
}

}  // namespace
}  // namespace relmap::workflow
