#include "proto/base/percent.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

TEST(Percent, EncodesAllButWhatIsUnreserved) {
  EXPECT_EQ(percent_encoded("Az09-._~"), "Az09-._~");
  EXPECT_EQ(percent_encoded("a b%\xc3\xa4/"), "a%20b%25%c3%a4%2f");
  std::string all;
  for (int c = 0; c < 256; ++c) all += static_cast<char>(c);
  EXPECT_EQ(percent_decoded(percent_encoded(all)), all);
}

TEST(Percent, DecodesDigitsOfEitherCaseAndNothingElse) {
  EXPECT_EQ(percent_decoded("%5Bfe80::1%25eth0%5d:5"), "[fe80::1%eth0]:5");
  for (const char* wrong : {"%", "a%4", "%4g", "%g4", "%%41"}) EXPECT_FALSE(percent_decoded(wrong)) << wrong;
}

}  // namespace
}  // namespace relmap
