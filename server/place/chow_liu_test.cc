#include "server/place/chow_liu.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace relmap::place {
namespace {

TEST(MutualInformation, EqualsItsDefinition) {
  EXPECT_NEAR(mutual_information(5, 5, 5, 10), std::log(2), 1e-12) << "the same fair coin";
  EXPECT_NEAR(mutual_information(0, 5, 5, 10), std::log(2), 1e-12) << "its opposite";
  EXPECT_NEAR(mutual_information(25, 50, 50, 100), 0, 1e-12) << "two coins";
  EXPECT_NEAR(mutual_information(0, 0, 30, 100), 0, 1e-12);
  const double direct = 0.3 * std::log(0.3 / (0.4 * 0.5)) + 0.1 * std::log(0.1 / (0.4 * 0.5)) +
                        0.2 * std::log(0.2 / (0.6 * 0.5)) + 0.4 * std::log(0.4 / (0.6 * 0.5));
  EXPECT_NEAR(mutual_information(3, 4, 5, 10), direct, 1e-12);
}

// Documents drawn from a known tree: word 0 is the root, 1 and 2 copy 0, 3 copies 2, each with an error rate of 1/8.
std::vector<std::vector<std::uint32_t>> documents_of_a_tree(std::size_t count) {
  std::mt19937_64 random(1);
  std::vector<std::vector<std::uint32_t>> documents;
  for (std::size_t d = 0; d < count; ++d) {
    const auto copy = [&](bool value) { return random() % 8 == 0 ? !value : value; };
    const bool w0 = random() % 3 == 0, w1 = copy(w0), w2 = copy(w0), w3 = copy(w2);
    std::vector<std::uint32_t> words;
    if (w0) words.push_back(0);
    if (w1) words.push_back(1);
    if (w2) words.push_back(2);
    if (w3) words.push_back(3);
    documents.push_back(words);
  }
  return documents;
}

TEST(ChowLiu, FindsTheTreeThatDrewTheDocuments) {
  const ChowLiuTree tree = learn_chow_liu(documents_of_a_tree(4000), 4);
  EXPECT_EQ(tree.parent, (std::vector<std::uint32_t>{0, 0, 0, 2}));
  EXPECT_NEAR(tree.marginal[0], 1.0 / 3, 0.03);
  for (const std::size_t w : {1u, 2u, 3u}) {
    EXPECT_NEAR(tree.given_parent_present[w], 7.0 / 8, 0.03);
    EXPECT_NEAR(tree.given_parent_absent[w], 1.0 / 8, 0.03);
  }
  EXPECT_EQ(tree.given_parent_absent[0], tree.marginal[0]);
  EXPECT_EQ(tree.given_parent_present[0], tree.marginal[0]);
}

TEST(ChowLiu, NoOtherTreeHoldsMoreInformation) {
  std::mt19937_64 random(2);
  std::vector<std::vector<std::uint32_t>> documents(200);
  for (auto& document : documents) {
    const auto mood = random() % 4;
    for (std::uint32_t w = 0; w < 5; ++w)
      if (random() % 4 < (w + mood) % 4) document.push_back(w);
  }
  const auto count = [&](std::uint32_t x, std::uint32_t y) {
    return static_cast<std::size_t>(std::count_if(documents.begin(), documents.end(), [&](const auto& d) {
      return std::count(d.begin(), d.end(), x) && std::count(d.begin(), d.end(), y);
    }));
  };
  const auto information = [&](std::uint32_t x, std::uint32_t y) {
    return mutual_information(count(x, y), count(x, x), count(y, y), documents.size());
  };
  const ChowLiuTree tree = learn_chow_liu(documents, 5);
  double found = 0;
  for (std::uint32_t w = 1; w < 5; ++w) found += information(w, tree.parent[w]);
  // Every parent table in which each word reaches word 0.
  for (std::uint32_t code = 0; code < 5 * 5 * 5 * 5; ++code) {
    const std::uint32_t parent[5] = {0, code % 5, code / 5 % 5, code / 25 % 5, code / 125 % 5};
    bool is_tree = true;
    for (std::uint32_t w = 1; w < 5 && is_tree; ++w) {
      std::uint32_t at = w;
      for (int step = 0; step < 5; ++step) at = parent[at];
      is_tree = at == 0;
    }
    if (!is_tree) continue;
    double other = 0;
    for (std::uint32_t w = 1; w < 5; ++w) other += information(w, parent[w]);
    EXPECT_LE(other, found + 1e-12);
  }
}

TEST(ChowLiu, AWordThatWasNeverSeenHasAPositiveProbability) {
  const std::vector<std::vector<std::uint32_t>> documents(50, {0});
  const ChowLiuTree tree = learn_chow_liu(documents, 3);
  for (const auto* table : {&tree.marginal, &tree.given_parent_absent, &tree.given_parent_present})
    for (const float p : *table) {
      EXPECT_GT(p, 0.f);
      EXPECT_LT(p, 1.f);
    }
}

}  // namespace
}  // namespace relmap::place
