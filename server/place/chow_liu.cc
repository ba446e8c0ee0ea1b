#include "server/place/chow_liu.h"

#include <bit>
#include <cmath>

#include "server/place/vocabulary_format.h"

namespace relmap::place {
namespace {

// The documents that show each word, as bitmaps.
class Presence {
 public:
  Presence(std::span<const std::vector<std::uint32_t>> documents, std::uint32_t words)
      : stride_((documents.size() + 63) / 64), bits_(stride_ * words), counts_(words) {
    for (std::size_t d = 0; d < documents.size(); ++d)
      for (const std::uint32_t word : documents[d]) {
        bits_[word * stride_ + d / 64] |= std::uint64_t{1} << (d % 64);
        ++counts_[word];
      }
  }
  std::size_t count(std::uint32_t word) const { return counts_[word]; }
  std::size_t both(std::uint32_t x, std::uint32_t y) const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < stride_; ++i)
      sum += static_cast<std::size_t>(std::popcount(bits_[x * stride_ + i] & bits_[y * stride_ + i]));
    return sum;
  }

 private:
  std::size_t stride_;
  std::vector<std::uint64_t> bits_;
  std::vector<std::size_t> counts_;
};

float clip(double p) { return static_cast<float>(clip_probability(p)); }

}  // namespace

double mutual_information(std::size_t both, std::size_t x, std::size_t y, std::size_t total) {
  const auto n = static_cast<double>(total);
  const auto term = [&](std::size_t joint, std::size_t a, std::size_t b) {
    if (joint == 0) return 0.0;
    const auto j = static_cast<double>(joint);
    return j / n * std::log(j * n / (static_cast<double>(a) * static_cast<double>(b)));
  };
  return term(both, x, y) + term(x - both, x, total - y) + term(y - both, total - x, y) +
         term(total + both - x - y, total - x, total - y);
}

ChowLiuTree learn_chow_liu(std::span<const std::vector<std::uint32_t>> documents, std::uint32_t words,
                           const std::function<void(double)>& progress) {
  const Presence presence(documents, words);
  ChowLiuTree tree;
  tree.parent.assign(words, 0);

  // Prim's algorithm on the complete graph, whose weights are computed as they are needed.
  std::vector<double> weight(words, -1);
  std::vector<bool> inside(words);
  std::uint32_t newest = 0;
  for (std::uint32_t step = 1; step < words; ++step) {
    inside[newest] = true;
    std::uint32_t next = newest;
    for (std::uint32_t w = 0; w < words; ++w) {
      if (inside[w]) continue;
      const double information =
          mutual_information(presence.both(newest, w), presence.count(newest), presence.count(w), documents.size());
      if (information > weight[w]) {
        weight[w] = information;
        tree.parent[w] = newest;
      }
      if (inside[next] || weight[w] > weight[next]) next = w;
    }
    newest = next;
    if (progress && step % 64 == 0) progress(static_cast<double>(step) / words);
  }

  // Frequencies, drawn towards the marginal with the weight of one document: what was seen once is not certain.
  const auto total = static_cast<double>(documents.size());
  for (std::uint32_t w = 0; w < words; ++w) {
    const auto present = static_cast<double>(presence.count(w));
    const double marginal = (present + 0.5) / (total + 1);
    tree.marginal.push_back(clip(marginal));
    if (tree.parent[w] == w) {
      tree.given_parent_absent.push_back(clip(marginal));
      tree.given_parent_present.push_back(clip(marginal));
      continue;
    }
    const auto parent = static_cast<double>(presence.count(tree.parent[w]));
    const auto both = static_cast<double>(presence.both(w, tree.parent[w]));
    tree.given_parent_absent.push_back(clip((present - both + marginal) / (total - parent + 1)));
    tree.given_parent_present.push_back(clip((both + marginal) / (parent + 1)));
  }
  if (progress) progress(1);
  return tree;
}

}  // namespace relmap::place
