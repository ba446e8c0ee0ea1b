#include "tools/vocab/reliability.h"

#include <gtest/gtest.h>

namespace relmap::vocab {
namespace {

TEST(Reliability, ComparesProbabilitiesWithHowOftenTheyComeTrue) {
  std::vector<Claim> claims;
  for (int i = 0; i < 10; ++i) claims.push_back({0.85, i < 8});
  for (int i = 0; i < 10; ++i) claims.push_back({0.15, i < 4});
  claims.push_back({0.01, true});  // nobody acts on it
  const Reliability found = reliability(claims);
  EXPECT_EQ(found.claims, 20u);
  EXPECT_EQ(found.bins[8].claims, 10u);
  EXPECT_NEAR(found.bins[8].said, 0.85, 1e-12);
  EXPECT_NEAR(found.bins[8].came_true, 0.8, 1e-12);
  EXPECT_NEAR(found.error, (0.05 + 0.25) / 2, 1e-12);
  EXPECT_EQ(reliability(std::vector<Claim>{{1, true}}).bins[9].claims, 1u);
  EXPECT_EQ(reliability({}).error, 0);
}

TEST(Reliability, IsDrawn) {
  std::vector<Claim> claims(20, {0.5, true});
  const std::string svg = draw({{"street", reliability(claims)}});
  EXPECT_NE(svg.find("street: 20 claims, off by 0.500"), std::string::npos);
  EXPECT_TRUE(svg.ends_with("</svg>\n"));
}

}  // namespace
}  // namespace relmap::vocab
