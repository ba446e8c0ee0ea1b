#include "server/place/vocabulary.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>

#include "proto/base/crc32c.h"
#include "server/place/testing/random_vocabulary.h"

namespace relmap::place {
namespace {

class VocabularyFile : public testing::Test {
 protected:
  void SetUp() override { path_ = testing::TempDir() + "relmap_vocabulary_" + std::to_string(getpid()); }
  void TearDown() override { std::remove(path_.c_str()); }
  void write(const Bytes& bytes) {
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  std::string path_;
};

void seal(Bytes& bytes) {
  const std::uint32_t crc = crc32c(ByteSpan(bytes).first(bytes.size() - 4));
  std::memcpy(bytes.data() + bytes.size() - 4, &crc, 4);
}

Reason reason_of(Bytes bytes) {
  seal(bytes);
  return Vocabulary::from_bytes(std::move(bytes)).reason();
}

TEST_F(VocabularyFile, GivesBackWhatWasWritten) {
  const VocabularyModel model = random_vocabulary_model(100, 5, 1);
  write(encode_vocabulary(model));
  const auto loaded = Vocabulary::load(path_);
  ASSERT_TRUE(loaded.ok()) << loaded.status().to_string();
  const Vocabulary& vocabulary = **loaded;
  EXPECT_EQ(vocabulary.size(), 100u);
  EXPECT_EQ(vocabulary.source(), model.source);
  EXPECT_TRUE(std::equal(model.marginal.begin(), model.marginal.end(), vocabulary.marginal().begin()));
  EXPECT_TRUE(std::equal(model.parent.begin(), model.parent.end(), vocabulary.parent().begin()));
  EXPECT_TRUE(std::equal(model.given_parent_absent.begin(), model.given_parent_absent.end(),
                         vocabulary.given_parent_absent().begin()));
  EXPECT_TRUE(std::equal(model.given_parent_present.begin(), model.given_parent_present.end(),
                         vocabulary.given_parent_present().begin()));
  ASSERT_EQ(vocabulary.sample_places(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    const auto place = vocabulary.sample_place(i);
    EXPECT_EQ(std::vector(place.begin(), place.end()), model.sample_places[i]);
  }
}

TEST_F(VocabularyFile, LoadsTwentyThousandWords) {
  write(encode_vocabulary(random_vocabulary_model(20'000, 400, 2)));
  const auto loaded = Vocabulary::load(path_);
  ASSERT_TRUE(loaded.ok());
  EXPECT_EQ((*loaded)->size(), 20'000u);
  EXPECT_EQ((*loaded)->sample_places(), 400u);
}

TEST_F(VocabularyFile, NamesWhatIsWrong) {
  EXPECT_EQ(Vocabulary::load(path_).reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(Vocabulary::load(testing::TempDir()).reason(), Reason::NO_SUCH_FILE);
  write({});
  EXPECT_EQ(Vocabulary::load(path_).reason(), Reason::CORRUPT);
  Bytes bytes = encode_vocabulary(random_vocabulary_model(10, 1, 3));
  bytes[8] = 2;
  write(bytes);
  EXPECT_EQ(Vocabulary::load(path_).reason(), Reason::UNKNOWN_FORMAT_VERSION);
}

TEST(VocabularyBytes, TheChecksumIdentifiesTheContent) {
  const auto crc = [](std::uint64_t seed) { return random_vocabulary(10, 1, seed)->crc(); };
  EXPECT_EQ(crc(4), crc(4));
  EXPECT_NE(crc(4), crc(5));
}

TEST(VocabularyBytes, AnyFlippedBitIsRefused) {
  const Bytes good = encode_vocabulary(random_vocabulary_model(10, 2, 6));
  for (std::size_t i = 0; i < good.size(); ++i) {
    Bytes bad = good;
    bad[i] = static_cast<std::uint8_t>(bad[i] ^ (1u << (i % 8)));
    EXPECT_FALSE(Vocabulary::from_bytes(std::move(bad)).ok()) << "byte " << i;
  }
}

TEST(VocabularyBytes, AnyTruncationIsRefused) {
  const Bytes good = encode_vocabulary(random_vocabulary_model(10, 2, 7));
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_EQ(Vocabulary::from_bytes(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size))).reason(),
              Reason::CORRUPT);
}

TEST(VocabularyBytes, TablesThatNoTrainerWritesAreRefusedThoughTheChecksumHolds) {
  const VocabularyModel good = random_vocabulary_model(10, 2, 8);
  EXPECT_EQ(reason_of(encode_vocabulary(good)), Reason::OK);
  const auto reason_with = [&](auto change) {
    VocabularyModel bad = good;
    change(bad);
    return reason_of(encode_vocabulary(bad));
  };
  EXPECT_EQ(reason_with([](auto& m) { m.parent[3] = 10; }), Reason::CORRUPT);
  EXPECT_EQ(reason_with([](auto& m) { m.parent[3] = 3; }), Reason::CORRUPT) << "two roots";
  EXPECT_EQ(reason_with([](auto& m) { m.parent[3] = 4, m.parent[4] = 3; }), Reason::CORRUPT) << "a cycle";
  EXPECT_EQ(reason_with([](auto& m) { m.marginal[0] = NAN; }), Reason::CORRUPT);
  EXPECT_EQ(reason_with([](auto& m) { m.given_parent_absent[5] = 0; }), Reason::CORRUPT);
  EXPECT_EQ(reason_with([](auto& m) { m.given_parent_present[5] = 1; }), Reason::CORRUPT);
  EXPECT_EQ(reason_with([](auto& m) { m.given_parent_present[0] = 0.5; }), Reason::CORRUPT) << "the root has a parent";
  EXPECT_EQ(reason_with([](auto& m) { m.branch_begin[1] = 0; }), Reason::CORRUPT);
  EXPECT_EQ(reason_with([](auto& m) { m.branch_begin.back() = 11; }), Reason::CORRUPT);
  EXPECT_EQ(reason_with([](auto& m) { m.sample_places[0] = {10}; }), Reason::CORRUPT);
  EXPECT_EQ(reason_with([](auto& m) { m.sample_places[0] = {4, 4}; }), Reason::CORRUPT);
  EXPECT_EQ(reason_with([](auto& m) { m.sample_places.clear(); }), Reason::CORRUPT);
  EXPECT_EQ(reason_with([](auto& m) { m.source.assign(kMaxSourceBytes + 1, 'x'); }), Reason::CORRUPT);
}

TEST(ShippedVocabulary, IsFoundFromTheBuildTreeAndFitToUse) {
  const auto loaded = Vocabulary::load(default_vocabulary_path());
  ASSERT_TRUE(loaded.ok()) << loaded.status().to_string();
  EXPECT_GE((*loaded)->sample_places(), 200u);
  EXPECT_GE((*loaded)->size(), 1000u);
  EXPECT_NE((*loaded)->source().find("relmap-sim"), std::string::npos);
}

TEST(VocabularyWords, ACentroidIsItsOwnWord) {
  const VocabularyModel model = random_vocabulary_model(400, 1, 9);
  const auto vocabulary = Vocabulary::from_bytes(encode_vocabulary(model)).or_throw();
  std::vector<AppearanceFeature> features(model.centroids.size());
  for (std::size_t i = 0; i < features.size(); ++i) features[i].descriptor = model.centroids[i];
  const std::vector<std::uint32_t> words = vocabulary->words(features);
  ASSERT_EQ(words.size(), features.size());
  for (std::uint32_t i = 0; i < words.size(); ++i) EXPECT_EQ(words[i], i);
}

TEST(VocabularyWords, AreTheNearestWhereAllBranchesAreSearched) {
  VocabularyModel model = random_vocabulary_model(64, 1, 10);
  model.branches.resize(4);
  model.branch_begin = {0, 16, 32, 48, 64};
  const auto vocabulary = Vocabulary::from_bytes(encode_vocabulary(model)).or_throw();
  const VocabularyModel others = random_vocabulary_model(200, 1, 11);
  for (const Descriptor& descriptor : others.centroids) {
    AppearanceFeature feature;
    feature.descriptor = descriptor;
    const std::uint32_t word = vocabulary->words({&feature, 1})[0];
    for (const Descriptor& centroid : model.centroids)
      EXPECT_LE(squared_distance(descriptor, model.centroids[word]), squared_distance(descriptor, centroid));
  }
}

}  // namespace
}  // namespace relmap::place
