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
#include "server/place/hand_made_graph.h"
#include "server/place/place_index.h"
#include "tools/vocab/tf_idf.h"

namespace relmap {
namespace {

constexpr double kConfident = 0.5;
constexpr double kLeastProbability = 1e-4;                   // that an answer can be blamed for
constexpr StereoCamera kOneEye{400, 256, 192, 0, 512, 384};  // that it is mono is all that matters

// One method's best answer to a query of a place that the map may hold.
struct BestAnswer {
  double score = 0;
  bool right = false;
};

std::size_t right_at_full_precision(const std::vector<BestAnswer>& answers) {
  double highest_wrong = 0;
  for (const BestAnswer& answer : answers)
    if (!answer.right) highest_wrong = std::max(highest_wrong, answer.score);
  return static_cast<std::size_t>(std::count_if(answers.begin(), answers.end(), [&](const BestAnswer& answer) {
    return answer.right && answer.score > highest_wrong;
  }));
}

// As the server reads a picture that it is asked about.
Result<std::vector<AppearanceFeature>> appearance_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return Status(Reason::NO_SUCH_FILE, std::generic_category().message(errno));
  const Bytes bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const auto picture = decode_picture(bytes);
  if (!picture.ok()) return picture.status();
  return picture_appearance(picture->grey);
}

// The map that grows picture by picture, for both methods.
class GrowingMap {
 public:
  GrowingMap(std::shared_ptr<const Vocabulary> vocabulary, const RecognitionSet& set)
      : vocabulary_(std::move(vocabulary)), set_(set), index_(vocabulary_) {
    for (std::size_t i = 0; i < set.pictures.size(); ++i)
      number_of_[set.pictures[i].frame] = static_cast<std::uint32_t>(i);
  }

  void add(std::span<const std::uint32_t> words) {
    const auto& picture = set_.pictures[weights_.size()];
    weights_.push_back(tf_idf(*vocabulary_, words));
    if (!picture.stays || words.empty()) return;  // a place that shows nothing cannot be recognised
    if (!graph_.session(picture.frame.session)) graph_.add_session(picture.frame.session, kOneEye);
    graph_.add_frame(picture.frame);
    if (const Status status = index_.add(picture.frame, words); !status.ok()) throw StatusError(status);
  }

  PlaceAnswer fabmap(std::span<const std::uint32_t> words, std::uint32_t open) const {
    std::vector<FrameRange> masked;
    for (std::size_t i = open; i < weights_.size(); ++i) {
      const FrameId frame = set_.pictures[i].frame;
      masked.push_back({frame.session, frame.index, frame.index});
    }
    return index_.query(words, graph_, masked);
  }
  std::uint32_t number_of(FrameId frame) const { return number_of_.at(frame); }

  // Picture and cosine; `open` is not 0.
  std::pair<std::uint32_t, double> nearest(std::span<const std::uint32_t> words, std::uint32_t open) const {
    const WeightedWords query = tf_idf(*vocabulary_, words);
    std::pair<std::uint32_t, double> best{0, -1};
    for (std::uint32_t i = 0; i < open; ++i)
      if (const double score = cosine(query, weights_[i]); score > best.second) best = {i, score};
    return best;
  }

 private:
  std::shared_ptr<const Vocabulary> vocabulary_;
  const RecognitionSet& set_;
  PlaceIndex index_;
  HandMadeGraph graph_;
  std::map<FrameId, std::uint32_t> number_of_;
  std::vector<WeightedWords> weights_;
};

}  // namespace

Result<Evaluation> evaluate(const std::shared_ptr<const Vocabulary>& vocabulary, const RecognitionSet& set,
                            const std::function<void(double)>& progress) {
  Evaluation result;
  GrowingMap map(vocabulary, set);
  std::vector<BestAnswer> by_fabmap, by_tfidf;
  for (std::size_t i = 0; i < set.pictures.size(); ++i) {
    const RecognitionSet::Picture& picture = set.pictures[i];
    const auto features = appearance_of(picture.file);
    if (!features.ok()) return Status(features.reason(), picture.file + ": " + features.status().message());
    const std::vector<std::uint32_t> words = vocabulary->words(*features);

    if (picture.asks) {
      const auto shows_it = [&](std::uint32_t other) {
        return std::binary_search(picture.same.begin(), picture.same.end(), other);
      };
      ++result.queries;
      const PlaceAnswer answer = map.fabmap(words, picture.open);
      if (!answer.candidates.empty()) {
        const PlaceCandidate& best = answer.candidates.front();
        by_fabmap.push_back({best.probability, shows_it(map.number_of(best.frame))});
        result.answered += best.probability > kConfident;
        result.right += best.probability > kConfident && by_fabmap.back().right;
      }
      if (picture.open > 0) {
        const auto [nearest, score] = map.nearest(words, picture.open);
        by_tfidf.push_back({score, shows_it(nearest)});
      }
      double truth = picture.same.empty() ? answer.new_place : 0;
      for (const PlaceCandidate& candidate : answer.candidates)
        if (shows_it(map.number_of(candidate.frame))) truth += candidate.probability;
      result.log_probability += std::log(std::max(truth, kLeastProbability));
      ++(picture.same.empty() ? result.new_places : result.seen_before);
      result.new_places_right += picture.same.empty() && answer.new_place > kConfident;
    }
    map.add(words);
    if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(set.pictures.size()));
  }
  if (result.queries > 0) result.log_probability /= static_cast<double>(result.queries);
  result.right_at_full_precision = right_at_full_precision(by_fabmap);
  result.tfidf_right_at_full_precision = right_at_full_precision(by_tfidf);
  return result;
}

}  // namespace relmap
