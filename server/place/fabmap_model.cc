#include "server/place/fabmap_model.h"

#include <cmath>

#include "server/place/vocabulary_format.h"

namespace relmap::place {
namespace {

LogLikelihood fixed_point(double nats) { return std::llround(nats * kNat); }

}  // namespace

double word_likelihood(const DetectorModel& detector, double marginal, double given_parent, bool z, bool s) {
  const double p_seen[2] = {detector.seen_if_absent, detector.seen_if_present};  // by e
  // p(e = 1 | s), the prior of e being the marginal of z.
  const double s_if_present = s ? p_seen[1] : 1 - p_seen[1];
  const double s_if_absent = s ? p_seen[0] : 1 - p_seen[0];
  const double present = s_if_present * marginal / (s_if_present * marginal + s_if_absent * (1 - marginal));

  double seen = 0;  // f(1, zp, s)
  for (const int e : {0, 1}) {
    const double alpha = marginal * (1 - p_seen[e]) * (1 - given_parent);
    const double beta = (1 - marginal) * p_seen[e] * given_parent;
    seen += beta / (alpha + beta) * (e ? present : 1 - present);
  }
  seen = clip_probability(seen);
  return z ? seen : 1 - seen;
}

FabMapModel::FabMapModel(const Vocabulary& vocabulary, const DetectorModel& detector) {
  const std::uint32_t n = vocabulary.size();
  terms_.resize(n);
  parent_.assign(vocabulary.parent().begin(), vocabulary.parent().end());
  child_begin_.assign(n + 1, 0);
  for (std::uint32_t w = 0; w < n; ++w) {
    const double marginal = clip_probability(vocabulary.marginal()[w]);
    const double given[2] = {clip_probability(vocabulary.given_parent_absent()[w]),
                             clip_probability(vocabulary.given_parent_present()[w])};
    const auto log_f = [&](bool z, bool zp, bool s) {
      return std::log(word_likelihood(detector, marginal, given[zp], z, s));
    };
    Terms& t = terms_[w];
    const double absent = log_f(false, false, false);
    const double place = log_f(false, false, true) - absent;
    t.place = fixed_point(place);
    const auto set = [&](WordCase seen, bool z, bool zp) {
      const double base = log_f(z, zp, false);
      t.query[static_cast<std::size_t>(seen)] = fixed_point(base - absent);
      t.increment[static_cast<std::size_t>(seen)] = fixed_point(log_f(z, zp, true) - base - place);
    };
    set(WordCase::kOnlyParent, false, true);
    set(WordCase::kOnlyWord, true, false);
    set(WordCase::kBoth, true, true);
    all_absent_ += fixed_point(absent);
    if (parent_[w] != w) ++child_begin_[parent_[w] + 1];
  }
  for (std::uint32_t w = 0; w < n; ++w) child_begin_[w + 1] += child_begin_[w];
  children_.resize(child_begin_[n]);
  std::vector<std::uint32_t> next(child_begin_.begin(), child_begin_.end() - 1);
  for (std::uint32_t w = 0; w < n; ++w)
    if (parent_[w] != w) children_[next[parent_[w]]++] = w;
}

LogLikelihood FabMapModel::place(std::span<const std::uint32_t> words) const {
  LogLikelihood sum = 0;
  for (const std::uint32_t word : words) sum += terms_[word].place;
  return sum;
}

std::vector<TouchedWord> FabMapModel::touched_by(std::span<const std::uint32_t> query) const {
  std::vector<bool> shown(size());
  for (const std::uint32_t word : query) shown[word] = true;
  std::vector<TouchedWord> touched;
  for (const std::uint32_t word : query) {
    touched.push_back({word, shown[parent_[word]] ? WordCase::kBoth : WordCase::kOnlyWord});
    for (std::uint32_t i = child_begin_[word]; i < child_begin_[word + 1]; ++i)
      if (!shown[children_[i]]) touched.push_back({children_[i], WordCase::kOnlyParent});
  }
  return touched;
}

LogLikelihood FabMapModel::empty_place(std::span<const TouchedWord> touched) const {
  LogLikelihood sum = all_absent_;
  for (const TouchedWord& t : touched) sum += terms_[t.word].query[static_cast<std::size_t>(t.seen)];
  return sum;
}

std::size_t FabMapModel::memory_bytes() const {
  return terms_.capacity() * sizeof(Terms) +
         (parent_.capacity() + child_begin_.capacity() + children_.capacity()) * sizeof(std::uint32_t);
}

}  // namespace relmap::place
