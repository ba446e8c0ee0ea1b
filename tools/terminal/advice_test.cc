#include "tools/terminal/advice.h"

#include <gtest/gtest.h>

namespace relmap::terminal {
namespace {

TEST(Advice, IsForWhatAnOperatorHasToDo) {
  for (const Reason reason : {Reason::DISK_FULL, Reason::READ_ONLY, Reason::UNREACHABLE, Reason::UNAUTHENTICATED,
                              Reason::WRONG_CALIBRATION, Reason::TOO_MANY_FILES, Reason::SEQUENCE_CONFLICT})
    EXPECT_TRUE(is_operational(reason)) << reason_name(reason);
  for (const Reason reason : {Reason::OK, Reason::NEW_PLACE, Reason::NO_SUCH_FRAME, Reason::INVALID_ARGUMENT,
                              Reason::LONE, Reason::DEADLINE, Reason::NO_SUCH_FILE, Reason::NO_CAMERA})
    EXPECT_FALSE(is_operational(reason)) << reason_name(reason);
}

TEST(Advice, NamesEachReasonOnce) {
  EXPECT_EQ(advice_on({Reason::DISK_FULL, Reason::OK, Reason::READ_ONLY, Reason::DISK_FULL}),
            "relmap-admin explain DISK_FULL READ_ONLY tells what to do");
  EXPECT_EQ(advice_on({Reason::NEW_PLACE}), "");
  EXPECT_EQ(advice_on({}), "");
}

TEST(Advice, FindsReasonsInWhatIsPrinted) {
  EXPECT_EQ(operational_in("it stays as it was: BAD_CONFIG: line 13 of /DISK/FULL"), std::vector{Reason::BAD_CONFIG});
  EXPECT_EQ(operational_in("READ_ONLY: record 7: DATA_LOSS, NEW_PLACE, DISK_FULLNESS"),
            (std::vector{Reason::READ_ONLY, Reason::DATA_LOSS}));
  EXPECT_TRUE(operational_in("").empty());
}

}  // namespace
}  // namespace relmap::terminal
