// The likelihood of FAB-MAP, word by word (Cummins and Newman, IJRR 27(6) 2008, section 4), in the form that suits
// inverted lists (IJRR 30(9) 2011, section 3).
//
// z: the query shows the word; zp: it shows the word's parent in the Chow-Liu tree (the root is its own parent);
// s: the word was seen at the place; e: it exists there.
//   f(z, zp, s) = sum_e p(z | e, zp) p(e | s)
//   p(z = S | e, zp) = beta / (alpha + beta),  alpha = p(z = S) p(z = not S | e) p(z = not S | zp),
//                                              beta = p(z = not S) p(z = S | e) p(z = S | zp)
// A place's log-likelihood is the sum of log f over all words. Only words that the query shows, or whose parent it
// shows, differ from the case (z, zp) = (0, 0), so a query reads their lists and not those of the whole vocabulary.
//
// Terms are integers in steps of 2^-36 nats. Sums are therefore exact in any order, and depend only on place, query and
// vocabulary. The error of a term is at most 7e-12.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/place/vocabulary.h"

namespace relmap::place {

// Fitted on simulated worlds (docs/decisions/recognition.md).
struct DetectorModel {
  double seen_if_present = 0.5;  // p(z = 1 | e = 1)
  double seen_if_absent = 0.1;   // p(z = 1 | e = 0)
};

// f(z, zp, s) of one word with p(z = 1) = marginal and p(z = 1 | zp) = given_parent.
double word_likelihood(const DetectorModel& detector, double marginal, double given_parent, bool z, bool s);

// Whether a query shows a word, its parent or both. All other words, which show neither, need no case.
enum class WordCase : std::uint8_t { kOnlyParent = 0, kOnlyWord = 1, kBoth = 2 };

struct TouchedWord {
  std::uint32_t word;
  WordCase seen;
};

// In steps of 2^-36 nats. The largest sum, over 2^20 words, is below 2^61.
using LogLikelihood = std::int64_t;
inline constexpr double kNat = 0x1p36;
inline double in_nats(LogLikelihood value) { return static_cast<double>(value) / kNat; }

// Immutable and thread-safe.
class FabMapModel {
 public:
  explicit FabMapModel(const Vocabulary& vocabulary, const DetectorModel& detector = {});

  std::uint32_t size() const { return static_cast<std::uint32_t>(terms_.size()); }  // words

  // The constant of a place that shows these words: the sum of their log f(0, 0, 1) / f(0, 0, 0).
  LogLikelihood place(std::span<const std::uint32_t> words) const;
  // What a query that touches this word adds to the score of each place that shows the word:
  // log f(z, zp, 1) / f(z, zp, 0) - log f(0, 0, 1) / f(0, 0, 0).
  LogLikelihood increment(TouchedWord touched) const {
    return terms_[touched.word].increment[static_cast<std::size_t>(touched.seen)];
  }

  // The words that the query shows or whose parent it shows. `query` is sorted and unique.
  std::vector<TouchedWord> touched_by(std::span<const std::uint32_t> query) const;
  // Log-likelihood of the query at a place without words.
  LogLikelihood empty_place(std::span<const TouchedWord> touched) const;

  std::size_t memory_bytes() const;

 private:
  struct Terms {
    LogLikelihood place;                 // log f(0,0,1) - log f(0,0,0)
    std::array<LogLikelihood, 3> query;  // log f(z,zp,0) - log f(0,0,0)
    std::array<LogLikelihood, 3> increment;
  };
  std::vector<Terms> terms_;
  LogLikelihood all_absent_ = 0;  // sum over words of log f(0,0,0)
  std::vector<std::uint32_t> parent_, child_begin_, children_;
};

}  // namespace relmap::place
