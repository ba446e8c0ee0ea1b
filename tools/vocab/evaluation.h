// How well a vocabulary recognises places: a recording is shown picture by picture, each asks and then becomes a place.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "server/place/vocabulary.h"
#include "tools/vocab/recognition_set.h"

namespace relmap::vocab {

inline constexpr std::array<std::size_t, 3> kFirst = {1, 5, 20};  // of the candidates, in their order
inline constexpr std::size_t kVerifiedFirst = 5;                  // candidates that geometry is tried on

// Queries whose place the map holds.
struct Recall {
  std::array<std::size_t, kFirst.size()> among_first = {};
  // Right by the first candidate, and that more certain than the most certain wrong one of all queries.
  std::size_t at_full_precision = 0;
};

// Of one way to find candidates: before geometry, and after it has tried the first few (verified ones then come first,
// by their inliers, and only they have any certainty).
struct Candidates {
  Recall before, after;
  std::size_t verified = 0, verified_wrong = 0;  // queries whose first candidate is verified; and is wrong
};

// A probability that was given, and whether it was so.
struct Claim {
  double probability = 0;
  bool right = false;
};

// A candidate is right where it, or the picture before or after it, which geometry looks at as well, shows the place.
struct Evaluation {
  std::size_t queries = 0;
  std::size_t seen_before = 0;  // of them: the map holds the place
  std::size_t new_places = 0;   // of them: it does not
  std::size_t answered = 0;     // best place has p > 0.5
  std::size_t right = 0;        // of those answered
  Candidates ours, tfidf;
  std::size_t new_places_right = 0;  // of new_places: p(new) > 0.5
  double log_probability = 0;        // mean, of the truth: the place, or that it is new; each at least log 1e-4
  std::vector<Claim> claims;         // of every query: each candidate, and that the place is new
};

// Reads the pictures. `verify`: with geometry, which takes most of the time. NO_SUCH_FILE, and reasons of
// decode_picture().
Result<Evaluation> evaluate(const std::shared_ptr<const place::Vocabulary>& vocabulary, const RecognitionSet& set,
                            bool verify, const std::function<void(double)>& progress = {});

}  // namespace relmap::vocab
