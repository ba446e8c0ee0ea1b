#include "server/place/vocabulary_format.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "proto/base/crc32c.h"

namespace relmap::place {
namespace {

constexpr char kVocabularyMagic[] = "RELMAPVO";
constexpr std::size_t kVocabularyHeaderBytes = 32;

std::size_t to_multiple_of_4(std::size_t bytes) { return (bytes + 3) / 4 * 4; }

// Hands out one table after another; the total size has been checked before.
class Cursor {
 public:
  explicit Cursor(ByteSpan bytes) : next_(bytes.data()) {}

  template <typename T>
  std::span<const T> take(std::size_t count) {
    const auto* first = reinterpret_cast<const T*>(next_);
    next_ += count * sizeof(T);
    return {first, count};
  }
  void skip_to(const std::uint8_t* position) { next_ = position; }

 private:
  const std::uint8_t* next_;
};

Status corrupt_vocabulary(const std::string& what) { return {Reason::CORRUPT, "vocabulary: " + what}; }

// Offsets from 0 to `end`; strictly ascending if `none_empty`.
bool are_offsets(std::span<const std::uint32_t> begin, std::uint32_t end, bool none_empty) {
  if (begin.front() != 0 || begin.back() != end) return false;
  for (std::size_t i = 1; i < begin.size(); ++i)
    if (begin[i] < begin[i - 1] || (none_empty && begin[i] == begin[i - 1])) return false;
  return true;
}

bool are_probabilities(std::span<const float> values) {
  // A float rounds the floor by at most one part in 2^24.
  constexpr float kFloor = static_cast<float>(kProbabilityFloor) * 0.999f;
  return std::all_of(values.begin(), values.end(), [](float p) { return p >= kFloor && p <= 1 - kFloor; });
}

// Every word reaches the one root: no cycle.
bool is_tree(std::span<const std::uint32_t> parent) {
  const std::size_t n = parent.size();
  std::size_t roots = 0;
  for (std::size_t w = 0; w < n; ++w) {
    if (parent[w] >= n) return false;
    roots += parent[w] == w;
  }
  if (roots != 1) return false;
  enum : std::uint8_t { kNew, kOnPath, kRooted };
  std::vector<std::uint8_t> state(n, kNew);
  for (std::uint32_t w = 0; w < n; ++w) {
    std::uint32_t at = w;
    while (state[at] == kNew && parent[at] != at) {
      state[at] = kOnPath;
      at = parent[at];
    }
    if (state[at] == kOnPath) return false;
    state[at] = kRooted;
    for (at = w; state[at] == kOnPath; at = parent[at]) state[at] = kRooted;
  }
  return true;
}

Status check_tables(const VocabularyTables& t) {
  const auto words = static_cast<std::uint32_t>(t.centroids.size());
  if (!are_offsets(t.branch_begin, words, true)) return corrupt_vocabulary("branches do not partition the words");
  if (!is_tree(t.parent)) return corrupt_vocabulary("the parents are no tree");
  if (!are_probabilities(t.marginal) || !are_probabilities(t.given_parent_absent) ||
      !are_probabilities(t.given_parent_present))
    return corrupt_vocabulary("a probability outside its range");
  for (std::uint32_t w = 0; w < words; ++w)
    if (t.parent[w] == w && (t.given_parent_absent[w] != t.marginal[w] || t.given_parent_present[w] != t.marginal[w]))
      return corrupt_vocabulary("the root depends on a parent");
  if (!are_offsets(t.sample_begin, static_cast<std::uint32_t>(t.sample_words.size()), false))
    return corrupt_vocabulary("sample places overlap");
  for (std::size_t s = 0; s + 1 < t.sample_begin.size(); ++s)
    for (std::uint32_t i = t.sample_begin[s]; i < t.sample_begin[s + 1]; ++i)
      if (t.sample_words[i] >= words || (i > t.sample_begin[s] && t.sample_words[i] <= t.sample_words[i - 1]))
        return corrupt_vocabulary("sample place " + std::to_string(s) + " has unordered or unknown words");
  return {};
}

}  // namespace

Bytes encode_vocabulary(const VocabularyModel& model) {
  ByteWriter out;
  const auto put_descriptors = [&](const std::vector<Descriptor>& descriptors) {
    for (const Descriptor& d : descriptors) out.put_bytes(d);
  };
  const auto put_table = [&](const auto& table) { out.put_array(table.data(), table.size()); };

  std::vector<std::uint32_t> sample_begin{0}, sample_words;
  for (const auto& place : model.sample_places) {
    sample_words.insert(sample_words.end(), place.begin(), place.end());
    sample_begin.push_back(static_cast<std::uint32_t>(sample_words.size()));
  }

  out.put_bytes(as_bytes(kVocabularyMagic));
  out.put(kVocabularyVersion);
  out.put(static_cast<std::uint32_t>(model.centroids.size()));
  out.put(static_cast<std::uint32_t>(model.branches.size()));
  out.put(static_cast<std::uint32_t>(model.sample_places.size()));
  out.put(static_cast<std::uint32_t>(sample_words.size()));
  out.put(static_cast<std::uint32_t>(model.source.size()));
  out.put_bytes(as_bytes(model.source));
  while (out.size() % 4 != 0) out.put(std::uint8_t{0});
  put_descriptors(model.branches);
  put_table(model.branch_begin);
  put_descriptors(model.centroids);
  put_table(model.parent);
  put_table(model.marginal);
  put_table(model.given_parent_absent);
  put_table(model.given_parent_present);
  put_table(sample_begin);
  put_table(sample_words);
  out.put(crc32c(out.bytes()));
  return out.take();
}

Result<VocabularyTables> parse_vocabulary(ByteSpan bytes) {
  ByteReader in(bytes);
  const ByteSpan magic = in.get_bytes(8);
  if (!in.ok() || std::memcmp(magic.data(), kVocabularyMagic, 8) != 0)
    return corrupt_vocabulary("not a vocabulary file");
  const auto version = in.get<std::uint32_t>();
  if (in.ok() && version != kVocabularyVersion)
    return Status(Reason::UNKNOWN_FORMAT_VERSION,
                  "vocabulary version " + std::to_string(version) + ", known: " + std::to_string(kVocabularyVersion));
  const std::size_t words = in.get<std::uint32_t>();
  const std::size_t branches = in.get<std::uint32_t>();
  const std::size_t samples = in.get<std::uint32_t>();
  const std::size_t sample_words = in.get<std::uint32_t>();
  const std::size_t source_bytes = in.get<std::uint32_t>();
  if (!in.ok()) return corrupt_vocabulary("shorter than its header");
  if (words < 1 || words > kMaxWords || branches < 1 || branches > words || samples < 1 || samples > kMaxSamplePlaces ||
      source_bytes > kMaxSourceBytes)
    return corrupt_vocabulary("implausible counts");

  const std::size_t expected = kVocabularyHeaderBytes + to_multiple_of_4(source_bytes) +
                               (branches + words) * kDescriptorBytes +
                               4 * (branches + 1 + 4 * words + samples + 1 + sample_words + 1);
  if (bytes.size() != expected)
    return corrupt_vocabulary(std::to_string(bytes.size()) + " bytes where " + std::to_string(expected) +
                              " are announced");
  VocabularyTables t;
  std::memcpy(&t.crc, bytes.data() + bytes.size() - 4, 4);
  if (crc32c(bytes.first(bytes.size() - 4)) != t.crc) return corrupt_vocabulary("checksum mismatch");

  Cursor cursor(bytes.subspan(kVocabularyHeaderBytes));
  t.source = {reinterpret_cast<const char*>(bytes.data()) + kVocabularyHeaderBytes, source_bytes};
  cursor.skip_to(bytes.data() + kVocabularyHeaderBytes + to_multiple_of_4(source_bytes));
  t.branches = cursor.take<Descriptor>(branches);
  t.branch_begin = cursor.take<std::uint32_t>(branches + 1);
  t.centroids = cursor.take<Descriptor>(words);
  t.parent = cursor.take<std::uint32_t>(words);
  t.marginal = cursor.take<float>(words);
  t.given_parent_absent = cursor.take<float>(words);
  t.given_parent_present = cursor.take<float>(words);
  t.sample_begin = cursor.take<std::uint32_t>(samples + 1);
  t.sample_words = cursor.take<std::uint32_t>(sample_words);
  if (const Status status = check_tables(t); !status.ok()) return status;
  return t;
}

}  // namespace relmap::place
