#include "tools/vocab/reliability.h"

#include <gtest/gtest.h>

namespace relmap::vocab {
namespace {

TEST(Reliability, ComparesProbabilitiesWithHowOftenTheyComeTrue) {
  std::vector<Prediction> predictions;
  for (int i = 0; i < 10; ++i) predictions.push_back({0.85, i < 8});
  for (int i = 0; i < 10; ++i) predictions.push_back({0.15, i < 4});
  predictions.push_back({0.01, true});  // nobody acts on it
  const Reliability found = reliability(predictions);
  EXPECT_EQ(found.predictions, 20u);
  EXPECT_EQ(found.bins[8].predictions, 10u);
  EXPECT_NEAR(found.bins[8].said, 0.85, 1e-12);
  EXPECT_NEAR(found.bins[8].came_true, 0.8, 1e-12);
  EXPECT_NEAR(found.error, (0.05 + 0.25) / 2, 1e-12);
  EXPECT_EQ(reliability(std::vector<Prediction>{{1, true}}).bins[9].predictions, 1u);
  EXPECT_EQ(reliability({}).error, 0);
}

TEST(Reliability, IsDrawn) {
  std::vector<Prediction> predictions(20, {0.5, true});
  const std::string svg = draw({{"street", reliability(predictions)}});
  EXPECT_NE(svg.find("street: 20 predictions, off by 0.500"), std::string::npos);
  EXPECT_TRUE(svg.ends_with("</svg>\n"));
}

}  // namespace
}  // namespace relmap::vocab
