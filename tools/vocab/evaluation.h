// Measures how well a vocabulary recognises places. A recording is shown picture by picture; each picture asks for its
// place, and then becomes a place itself.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "server/place/vocabulary.h"
#include "tools/vocab/recognition_set.h"

namespace relmap::vocab {

inline constexpr std::array<std::size_t, 3> kFirst = {1, 5, 20};  // numbers of first candidates that are evaluated
inline constexpr std::size_t kVerifiedFirst = 5;                  // geometry is tried on so many first candidates

// Numbers of queries whose place the map holds and which are answered right.
struct Recall {
  std::array<std::size_t, kFirst.size()> among_first = {};
  // The first candidate is right, and more certain than the most certain wrong first candidate of all queries.
  std::size_t at_full_precision = 0;
};

// The result of one method of finding candidates, before and after geometry has tried the first few. Verified
// candidates then come first, by their inliers, and only these have any certainty.
struct Candidates {
  Recall before, after;
  std::size_t verified = 0, verified_wrong = 0;  // queries whose first candidate is verified; and is wrong
};

// A probability that was given to a statement, and whether the statement was true.
struct Prediction {
  double probability = 0;
  bool right = false;
};

// A candidate counts as right if it, or the picture before or after it, shows the place: geometry tries these, too.
struct Evaluation {
  std::size_t queries = 0;
  std::size_t seen_before = 0;  // of them: the map holds the place
  std::size_t new_places = 0;   // of them: it does not
  std::size_t answered = 0;     // best place has p > 0.5
  std::size_t right = 0;        // of those answered
  Candidates ours, tfidf;
  std::size_t new_places_right = 0;  // of new_places: p(new) > 0.5
  double log_probability = 0;        // mean log probability of the truth (the place, or "new"); at least log 1e-4 each
  std::vector<Prediction> predictions;  // of every query: one for each candidate, and one for "new"
};

// Evaluates the vocabulary on the set. `verify`: also with geometry, which takes most of the time. NO_SUCH_FILE, and
// reasons of decode_picture().
Result<Evaluation> evaluate(const std::shared_ptr<const place::Vocabulary>& vocabulary, const RecognitionSet& set,
                            bool verify, const std::function<void(double)>& progress = {});

}  // namespace relmap::vocab
