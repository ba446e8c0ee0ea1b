#include "frontend/capture/picture_list.h"

#include <gtest/gtest.h>

#include "frontend/capture/capture_time.h"

namespace relmap::capture {
namespace {

TEST(PictureList, IsEurocsOrTums) {
  const auto euroc =
      parse_picture_list("#timestamp [ns],filename\r\n1403715273262142976,a.png\r\n", TimeUnit::kNanoseconds, "cam0");
  ASSERT_TRUE(euroc.ok()) << euroc.status().to_string();
  EXPECT_EQ(euroc->front().path, "cam0/a.png");
  EXPECT_EQ(euroc->front().time_us, 1'403'715'273'262'142);
  const auto tum = parse_picture_list("0.5  rgb/of 1.png \n1.5\t/elsewhere/2.png", TimeUnit::kSeconds, "room");
  ASSERT_TRUE(tum.ok()) << tum.status().to_string();
  EXPECT_EQ((*tum)[0].path, "room/rgb/of 1.png");
  EXPECT_EQ((*tum)[0].time_us, kRelativeTimeBaseUs + 500'000);
  EXPECT_EQ((*tum)[1].path, "/elsewhere/2.png");
}

TEST(PictureList, RefusesByNameAndLine) {
  const auto reason = [](const char* text) { return parse_picture_list(text, TimeUnit::kSeconds, "").reason(); };
  EXPECT_EQ(reason(""), Reason::BAD_SIZE);
  EXPECT_EQ(reason("# nothing\n"), Reason::BAD_SIZE);
  EXPECT_EQ(reason("0.5\n"), Reason::CORRUPT);
  EXPECT_EQ(reason("a.png 0.5\n"), Reason::CORRUPT);
  EXPECT_EQ(reason("0.5 a.png\n0.5 b.png\n"), Reason::TIME_BACKWARDS);
  EXPECT_EQ(parse_picture_list("1 a\n\n0 b\n", TimeUnit::kSeconds, "").status().message().substr(0, 6), "line 3");
}

TEST(PairByTime, LeavesPicturesWithoutAPartnerAlone) {
  const auto timed = pair_by_time({{"l1", 10'000}, {"l2", 60'000}, {"l3", 110'000}, {"l4", 160'000}},
                                  {{"r0", 5'000}, {"r1", 11'000}, {"r3", 109'000}, {"r4", 161'001}});
  ASSERT_EQ(timed.pairs.size(), 2u);
  EXPECT_EQ(timed.pairs[0].right, "r1");
  EXPECT_EQ(timed.pairs[0].time_us, 10'000);
  EXPECT_EQ(timed.pairs[1].right, "r3");
  EXPECT_EQ(timed.alone, (std::vector<std::filesystem::path>{"r0", "l2", "l4", "r4"}));
}

}  // namespace
}  // namespace relmap::capture
