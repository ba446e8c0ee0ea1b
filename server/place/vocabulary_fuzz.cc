// Parses any bytes as a vocabulary file, with the checksum corrected so that the tables behind it are reached. What is
// accepted can be used, and is written again alike.
#include <algorithm>
#include <cstring>

#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "server/place/vocabulary.h"
#include "server/place/vocabulary_format.h"

namespace {

using namespace relmap;
using namespace relmap::place;
using fuzzing::must;

VocabularyModel model_of(const VocabularyTables& tables) {
  const auto all = [](auto table) { return std::vector(table.begin(), table.end()); };
  VocabularyModel model{std::string(tables.source),
                        all(tables.branches),
                        all(tables.branch_begin),
                        all(tables.centroids),
                        all(tables.parent),
                        all(tables.marginal),
                        all(tables.given_parent_absent),
                        all(tables.given_parent_present),
                        {}};
  for (std::size_t i = 0; i + 1 < tables.sample_begin.size(); ++i)
    model.sample_places.push_back(
        all(tables.sample_words.subspan(tables.sample_begin[i], tables.sample_begin[i + 1] - tables.sample_begin[i])));
  return model;
}

void check_encoding(const Bytes& bytes) {
  const auto tables = parse_vocabulary(bytes);
  must(tables.ok());
  const Bytes encoded = encode_vocabulary(model_of(*tables));
  must(encoded.size() == bytes.size());  // the bytes that fill up the source text may differ
  const auto again = parse_vocabulary(encoded);
  must(again.ok() && again->source == tables->source && std::ranges::equal(again->parent, tables->parent) &&
       std::ranges::equal(again->centroids, tables->centroids) &&
       std::ranges::equal(again->marginal, tables->marginal) &&
       std::ranges::equal(again->sample_words, tables->sample_words));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, data + size);
  if (size >= 4) {
    const std::uint32_t crc = crc32c(ByteSpan(bytes).first(size - 4));
    std::memcpy(bytes.data() + size - 4, &crc, 4);
  }
  const auto vocabulary = Vocabulary::from_bytes(bytes);
  if (!vocabulary.ok()) return 0;
  check_encoding(bytes);
  std::vector<AppearanceFeature> features(2);
  features[1].descriptor.fill(255);
  for (const std::uint32_t word : (*vocabulary)->words(features)) must(word < (*vocabulary)->size());
  for (std::size_t i = 0; i < (*vocabulary)->sample_places(); ++i)
    for (const std::uint32_t word : (*vocabulary)->sample_place(i)) must(word < (*vocabulary)->size());
  return 0;
}
