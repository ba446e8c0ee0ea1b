// How well a vocabulary recognises places: a recording is shown picture by picture, each asks and then becomes a place.
#pragma once

#include <functional>
#include <memory>

#include "server/place/vocabulary.h"
#include "tools/vocab/recognition_set.h"

namespace relmap {

// Answers before any geometric verification. An answer is right if it shows the place asked for.
struct Evaluation {
  std::size_t queries = 0;
  std::size_t seen_before = 0;  // of them: the map holds the place
  std::size_t new_places = 0;   // of them: it does not
  std::size_t answered = 0;     // best place has p > 0.5
  std::size_t right = 0;        // of those answered
  // Of seen_before: right, and more probable than the most probable wrong answer of all queries.
  std::size_t right_at_full_precision = 0, tfidf_right_at_full_precision = 0;
  std::size_t new_places_right = 0;  // of new_places: p(new) > 0.5
  double log_probability = 0;        // mean, of the truth: the place, or that it is new; each at least log 1e-4
};

// Reads the pictures. NO_SUCH_FILE, and reasons of decode_picture().
Result<Evaluation> evaluate(const std::shared_ptr<const Vocabulary>& vocabulary, const RecognitionSet& set,
                            const std::function<void(double)>& progress = {});

}  // namespace relmap
