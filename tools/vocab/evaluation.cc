#include "tools/vocab/evaluation.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <system_error>

#include "frontend/vision/picture.h"
#include "frontend/vision/picture_appearance.h"
#include "tools/vocab/growing_map.h"

namespace relmap::vocab {
namespace {

constexpr double kConfident = 0.5;
constexpr double kMinProbability = 1e-4;  // lower ones count as this, so that one answer cannot dominate

// Describes a picture as the server does for a query.
Result<DescribedPicture> describe_query(const std::string& file, const place::Vocabulary& vocabulary) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return Status(Reason::NO_SUCH_FILE, file + ": " + std::generic_category().message(errno));
  const Bytes bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const auto picture = vision::decode_picture(bytes);
  if (!picture.ok()) return Status(picture.reason(), file + ": " + picture.status().message());
  DescribedPicture described{
      vision::picture_appearance(picture->grey), {}, picture->grey.width(), picture->grey.height()};
  described.words = vocabulary.words(described.features);
  return described;
}

// Counts the answers of one method, query by query.
class RecallCount {
 public:
  // `right`: for each candidate, whether it is right. `certainty`: of the first one; 0: the method gives no answer.
  void add(const std::vector<bool>& right, double certainty) {
    const auto first_right = static_cast<std::size_t>(std::find(right.begin(), right.end(), true) - right.begin());
    if (first_right < right.size())
      for (std::size_t k = 0; k < kFirst.size(); ++k) recall_.among_first[k] += first_right < kFirst[k];
    if (right.empty() || certainty <= 0) return;
    if (right.front())
      right_.push_back(certainty);
    else
      highest_wrong_ = std::max(highest_wrong_, certainty);
  }
  Recall recall() const {
    Recall recall = recall_;
    recall.at_full_precision = static_cast<std::size_t>(
        std::count_if(right_.begin(), right_.end(), [&](double certainty) { return certainty > highest_wrong_; }));
    return recall;
  }

 private:
  Recall recall_;
  std::vector<double> right_;
  double highest_wrong_ = 0;
};

// Geometric verification of the candidates of one query; each frame is tried once.
class Geometry {
 public:
  Geometry(const GrowingMap& map, const RecognitionSet::Picture& asked, const DescribedPicture& picture)
      : map_(map), asked_(asked), picture_(picture) {}
  std::uint32_t inliers(FrameId frame) {
    const auto [entry, fresh] = tried_.try_emplace(frame, 0);
    if (fresh) entry->second = map_.verify(frame, asked_, picture_).value_or(0);
    return entry->second;
  }

 private:
  const GrowingMap& map_;
  const RecognitionSet::Picture& asked_;
  const DescribedPicture& picture_;
  std::map<FrameId, std::uint32_t> tried_;
};

// Judges one method of finding candidates, before and after geometry.
class Judge {
 public:
  void add(const GrowingMap& map, const RecognitionSet::Picture& asked, std::vector<place::PlaceCandidate> candidates,
           Geometry* geometry) {
    const auto right = [&] {
      std::vector<bool> is_right;
      for (const place::PlaceCandidate& candidate : candidates) is_right.push_back(map.shows(candidate.frame, asked));
      return is_right;
    };
    before_.add(right(), candidates.empty() ? 0 : candidates.front().probability);
    if (!geometry) return;
    std::map<FrameId, std::uint32_t> inliers;
    for (std::size_t i = 0; i < std::min(candidates.size(), kVerifiedFirst); ++i)
      inliers[candidates[i].frame] = geometry->inliers(candidates[i].frame);
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](const place::PlaceCandidate& x, const place::PlaceCandidate& y) {
                       return inliers[x.frame] > inliers[y.frame];
                     });
    const double certainty = candidates.empty() ? 0 : inliers[candidates.front().frame];
    const std::vector<bool> is_right = right();
    after_.add(is_right, certainty);
    verified_ += certainty > 0;
    verified_wrong_ += certainty > 0 && !is_right.front();
  }
  Candidates counts() const { return {before_.recall(), after_.recall(), verified_, verified_wrong_}; }

 private:
  RecallCount before_, after_;
  std::size_t verified_ = 0, verified_wrong_ = 0;
};

// Judges the probabilities that the index gives.
void judge_probabilities(const GrowingMap& map, const RecognitionSet::Picture& asked, const place::PlaceAnswer& answer,
                         Evaluation& result) {
  const bool is_new = asked.same.empty();
  double truth = is_new ? answer.new_place : 0;
  for (const place::PlaceCandidate& candidate : answer.candidates) {
    const bool right = map.shows(candidate.frame, asked);
    if (right) truth += candidate.probability;
    result.predictions.push_back({candidate.probability, right});
  }
  result.predictions.push_back({answer.new_place, is_new});
  result.log_probability += std::log(std::max(truth, kMinProbability));
  if (!answer.candidates.empty() && answer.candidates.front().probability > kConfident) {
    ++result.answered;
    result.right += map.shows(answer.candidates.front().frame, asked);
  }
  ++(is_new ? result.new_places : result.seen_before);
  result.new_places_right += is_new && answer.new_place > kConfident;
}

}  // namespace

Result<Evaluation> evaluate(const std::shared_ptr<const place::Vocabulary>& vocabulary, const RecognitionSet& set,
                            bool verify, const std::function<void(double)>& progress) {
  Evaluation result;
  GrowingMap map(vocabulary, set);
  Judge ours, tfidf;
  for (std::size_t i = 0; i < set.pictures.size(); ++i) {
    const RecognitionSet::Picture& asked = set.pictures[i];
    const auto picture = describe_query(asked.file, *vocabulary);
    if (!picture.ok()) return picture.status();
    if (asked.asks) {
      ++result.queries;
      Geometry geometry(map, asked, *picture);
      const place::PlaceAnswer answer = map.by_index(asked, *picture);
      judge_probabilities(map, asked, answer, result);
      ours.add(map, asked, answer.candidates, verify ? &geometry : nullptr);
      tfidf.add(map, asked, map.by_tf_idf(asked, *picture), verify ? &geometry : nullptr);
    }
    map.add(*picture);
    if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(set.pictures.size()));
  }
  if (result.queries > 0) result.log_probability /= static_cast<double>(result.queries);
  result.ours = ours.counts();
  result.tfidf = tfidf.counts();
  return result;
}

}  // namespace relmap::vocab
