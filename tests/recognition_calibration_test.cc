// Probabilities of places are calibrated: on simulated drives with known truth, of the predictions with about the same
// probability about that share is true. The choice of candidates for geometry depends on it (server/map/lookup.cc).
#include <gtest/gtest.h>

#include <cstdio>

#include "storage/testing/temporary_folder.h"
#include "tests/support/simulated_recording.h"
#include "tools/vocab/evaluation.h"
#include "tools/vocab/reliability.h"

namespace relmap::testing {
namespace {

TEST(RecognitionCalibration, OfSimulatedDrives) {
  const auto vocabulary = place::Vocabulary::load(place::default_vocabulary_path()).or_throw();
  std::vector<vocab::Prediction> predictions;
  std::size_t seen_before = 0, first = 0, at_full_precision = 0;
  for (const char* seed : {"5", "6"}) {
    const storage::TemporaryFolder folder;
    record_simulation(folder / "drive", {"--seed", seed, "--pairs", "110", "--laps", "1.5", "--step", "2.5", "--format",
                                         "jpg", "--exposure-variation", "0.3", "--lateral-deviation", "0.5"});
    const auto set = vocab::load_recognition_set("drive", {folder / "drive"}).or_throw();
    const vocab::Evaluation found = vocab::evaluate(vocabulary, set, false).or_throw();
    predictions.insert(predictions.end(), found.predictions.begin(), found.predictions.end());
    seen_before += found.seen_before;
    first += found.ours.before.among_first[0];
    at_full_precision += found.ours.before.at_full_precision;
    EXPECT_GE(found.ours.before.among_first[1], found.tfidf.before.among_first[1]);
  }
  const vocab::Reliability all = vocab::reliability(predictions);
  std::printf("of %zu seen before %zu first, %zu at full precision; %zu predictions, off by %.4f\n", seen_before, first,
              at_full_precision, all.predictions, all.error);
  EXPECT_GE(static_cast<double>(first), 0.97 * static_cast<double>(seen_before));
  EXPECT_GE(static_cast<double>(at_full_precision), 0.9 * static_cast<double>(seen_before));
  EXPECT_LE(all.error, 0.08);
  // Hardly anything that is almost certain is wrong.
  const auto& certain = all.bins.back();
  EXPECT_GE(certain.predictions, 100u);
  EXPECT_NEAR(certain.came_true, certain.said, 0.03);
}

}  // namespace
}  // namespace relmap::testing
