// Recognition in public recordings with the shipped vocabulary: how often the place of a picture is among the first
// candidates, and how often it is more certain than the most certain wrong one, compared with tf-idf on the same words.
// Parameters were fitted on other recordings, with these in view (docs/decisions/recognition.md).
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/support/data_test.h"
#include "tools/vocab/evaluation.h"

namespace relmap::testing {
namespace {

class Recognition : public DataTest {
 protected:
  vocab::Evaluation measured(const std::string& set, std::vector<std::string> folders, bool verify) const {
    for (std::string& folder : folders) folder = data_ + "/" + folder;
    const auto vocabulary = place::Vocabulary::load(place::default_vocabulary_path()).or_throw();
    const auto found =
        vocab::evaluate(vocabulary, vocab::load_recognition_set(set, folders).or_throw(), verify).or_throw();
    const auto print = [&](const char* when, const vocab::Recall& ours, const vocab::Recall& tfidf) {
      std::printf(
          "%s, %s: of %zu among the first 1, 5, 20: %zu, %zu, %zu; at full precision %zu (tf-idf %zu, %zu, %zu; %zu)\n",
          set.c_str(), when, found.seen_before, ours.among_first[0], ours.among_first[1], ours.among_first[2],
          ours.at_full_precision, tfidf.among_first[0], tfidf.among_first[1], tfidf.among_first[2],
          tfidf.at_full_precision);
    };
    print("before geometry", found.ours.before, found.tfidf.before);
    if (verify) print("after it", found.ours.after, found.tfidf.after);
    for (std::size_t k = 1; k < vocab::kFirst.size(); ++k)
      EXPECT_GE(found.ours.before.among_first[k], found.tfidf.before.among_first[k])
          << "the first " << vocab::kFirst[k];
    EXPECT_GE(found.ours.before.at_full_precision, found.tfidf.before.at_full_precision);
    return found;
  }
};

double share(std::size_t part, std::size_t whole) { return static_cast<double>(part) / static_cast<double>(whole); }

TEST_F(Recognition, ACorridorWalkedTwice) {
  const vocab::Evaluation found = measured("rtabmap", {"rtabmap_loop84"}, true);
  ASSERT_EQ(found.seen_before, 44u);
  EXPECT_GE(share(found.ours.before.among_first[1], found.seen_before), 0.95);
  EXPECT_GE(found.ours.before.at_full_precision, 39u);
  EXPECT_GE(share(found.new_places_right, found.new_places), 0.9);
  EXPECT_EQ(found.ours.verified_wrong, 0u);
  EXPECT_GE(found.ours.after.at_full_precision, found.tfidf.after.at_full_precision);
}

TEST_F(Recognition, AFlightThroughOneRoom) {
  const vocab::Evaluation found = measured("euroc", {"euroc_v101_keyframes100"}, false);
  ASSERT_EQ(found.seen_before, 39u);
  EXPECT_GE(share(found.ours.before.among_first[1], found.seen_before), 0.9);
}

TEST_F(Recognition, FloorsThatLookAlike) {
  const vocab::Evaluation found = measured("tower", {"ie_tower"}, true);
  ASSERT_EQ(found.seen_before, 48u);
  EXPECT_GE(share(found.ours.before.among_first[1], found.seen_before), 0.9);
  EXPECT_GE(found.ours.before.at_full_precision, 44u);
  EXPECT_EQ(found.ours.verified_wrong, 0u);
  EXPECT_GE(found.ours.after.at_full_precision, found.tfidf.after.at_full_precision);
}

TEST_F(Recognition, AreasOfFloorsThatLookAlike) {
  const vocab::Evaluation found = measured("tower-area", {"ie_tower"}, false);
  ASSERT_EQ(found.seen_before, 48u);
  EXPECT_GE(share(found.ours.before.among_first[1], found.seen_before), 0.9);
}

TEST_F(Recognition, PhotographsAlongAStreetAmongOtherPlaces) {
  const vocab::Evaluation found = measured("walk", {"lund_street29/images", "rtabmap_loop84/images"}, false);
  ASSERT_EQ(found.seen_before, 29u);
  EXPECT_GE(found.ours.before.at_full_precision, 25u);
}

TEST_F(Recognition, PhotographsOfOneFrontAmongOtherPlaces) {
  const vocab::Evaluation found =
      measured("front", {"landmarks/sacre_coeur10", "lund_street29/images", "rtabmap_loop84/images"}, false);
  ASSERT_EQ(found.seen_before, 10u);
  EXPECT_GE(found.ours.before.at_full_precision, 9u);
}

}  // namespace
}  // namespace relmap::testing
