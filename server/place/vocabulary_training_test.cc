#include "server/place/vocabulary_training.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "server/place/vocabulary.h"

namespace relmap::place {
namespace {

// Pictures of things, each of which has a few descriptors of its own that vary a little.
std::vector<std::vector<Descriptor>> pictures_of_things(std::size_t pictures, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Descriptor> things(60);
  for (auto& thing : things)
    for (auto& byte : thing) byte = static_cast<std::uint8_t>(random() % 200);
  std::vector<std::vector<Descriptor>> result(pictures);
  for (auto& picture : result)
    for (int i = 0; i < 30; ++i) {
      Descriptor d = things[random() % things.size()];
      for (auto& byte : d) byte = static_cast<std::uint8_t>(byte + random() % 20);
      picture.push_back(d);
    }
  return result;
}

TrainingOptions small() {
  TrainingOptions options;
  options.words = 60;
  options.sample_places = 20;
  options.source = "things";
  return options;
}

TEST(TrainVocabulary, MakesAFileThatIsAccepted) {
  const auto pictures = pictures_of_things(50, 1);
  const auto model = train_vocabulary(pictures, small());
  ASSERT_TRUE(model.ok()) << model.status().to_string();
  const auto vocabulary = Vocabulary::from_bytes(encode_vocabulary(*model));
  ASSERT_TRUE(vocabulary.ok()) << vocabulary.status().to_string();
  EXPECT_EQ((*vocabulary)->sample_places(), 20u);
  EXPECT_EQ((*vocabulary)->source(), "things");
  EXPECT_LE((*vocabulary)->size(), 60u);
  EXPECT_GT((*vocabulary)->size(), 40u);
  // A word's marginal is the share of pictures that show it.
  double mean = 0;
  for (const float p : (*vocabulary)->marginal()) mean += static_cast<double>(p) / (*vocabulary)->size();
  EXPECT_NEAR(mean, 1 - std::pow(59.0 / 60, 30), 0.1);
}

TEST(TrainVocabulary, IsDeterministic) {
  const auto pictures = pictures_of_things(50, 2);
  const auto a = train_vocabulary(pictures, small()), b = train_vocabulary(pictures, small());
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(encode_vocabulary(*a), encode_vocabulary(*b));
}

TEST(TrainVocabulary, ReportsItsProgress) {
  const auto pictures = pictures_of_things(50, 3);
  double last = 0;
  std::string stage;
  std::vector<std::string> stages;
  ASSERT_TRUE(train_vocabulary(pictures, small(), [&](std::string_view now, double share) {
                if (stage != now) {
                  EXPECT_TRUE(stage.empty() || last == 1) << stage;
                  stages.push_back(stage = now);
                  last = 0;
                }
                EXPECT_GE(share, last);
                last = share;
              }).ok());
  EXPECT_EQ(stages, (std::vector<std::string>{"words", "documents", "tree"}));
}

TEST(TrainVocabulary, RefusesTooLittle) {
  const auto reason = [](std::size_t pictures, auto change) {
    TrainingOptions options = small();
    change(options);
    return train_vocabulary(pictures_of_things(pictures, 4), options).reason();
  };
  EXPECT_EQ(reason(19, [](auto&) {}), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(reason(30, [](auto& o) { o.words = 0; }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(reason(30, [](auto& o) { o.words = 91; }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(reason(30, [](auto& o) { o.sample_places = 0; }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(reason(30, [](auto& o) { o.source.assign(5000, 'x'); }), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(reason(0, [](auto& o) { o.sample_places = 1; }), Reason::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace relmap::place
