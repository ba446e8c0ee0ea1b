#include "server/place/likeliest.h"

#include <gtest/gtest.h>

#include "server/place/testing/hand_made_graph.h"

namespace relmap::place {
namespace {

// Sessions 1 and 2 are of the same photographs, session 3 is of others.
class LikeliestPlaces : public ::testing::Test {
 protected:
  LikeliestPlaces() {
    for (const SessionNumber session : {1u, 2u, 3u}) {
      graph_.add_session(session, {0, 256, 192, 0, 512, 384});
      for (std::uint32_t index = 0; index < 5; ++index) {
        AppearanceFeature feature;
        feature.u = static_cast<float>(index);
        feature.v = session == 3 ? 1 : 0;
        storage::FrameCold cold;
        cold.appearance = {feature};
        graph_.add_frame({session, index}, {}, {}, cold);
      }
    }
  }

  HandMadeGraph graph_;
};

TEST_F(LikeliestPlaces, DoNotDependOnHowOftenTheirPhotographsWereAdded) {
  const std::vector<PlaceCandidate> once{{{1, 0}, 0.5}, {{1, 4}, 0.3}, {{3, 2}, 0.1}};
  const std::vector<PlaceCandidate> twice{
      {{1, 0}, 0.25}, {{2, 0}, 0.25}, {{1, 4}, 0.15}, {{2, 4}, 0.15}, {{3, 2}, 0.1}};
  for (const auto& candidates : {once, twice}) {
    const Likeliest found = likeliest(graph_, candidates);
    EXPECT_EQ(found.places, 3u);
    EXPECT_DOUBLE_EQ(found.best, 0.5);
    EXPECT_DOUBLE_EQ(found.other, 0.3);
    EXPECT_TRUE(found.ambiguous());
  }
}

TEST_F(LikeliestPlaces, TheBestMayBeTheSumOfLessLikelyOnes) {
  const Likeliest found = likeliest(graph_, std::vector<PlaceCandidate>{{{3, 2}, 0.4}, {{1, 0}, 0.3}, {{2, 0}, 0.3}});
  EXPECT_EQ(found.places, 2u);
  EXPECT_DOUBLE_EQ(found.best, 0.6);
  EXPECT_DOUBLE_EQ(found.other, 0.4);
}

TEST_F(LikeliestPlaces, ASinglePlaceStandsOut) {
  EXPECT_FALSE(likeliest(graph_, std::vector<PlaceCandidate>{{{3, 2}, 0.2}}).ambiguous());
}

}  // namespace
}  // namespace relmap::place
