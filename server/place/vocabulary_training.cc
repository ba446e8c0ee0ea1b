#include "server/place/vocabulary_training.h"

#include <algorithm>

#include "server/place/chow_liu.h"
#include "server/place/inverted_index.h"
#include "server/place/kmeans.h"
#include "server/place/word_search.h"

namespace relmap::place {
namespace {

// Every k-th of all descriptors, at most `max_points` of them.
std::vector<Descriptor> choose_points(std::span<const std::vector<Descriptor>> pictures, std::size_t total,
                                      std::size_t max_points) {
  const std::size_t step = std::max<std::size_t>(1, (total + max_points - 1) / max_points);
  std::vector<Descriptor> points;
  points.reserve(total / step + 1);
  std::size_t i = 0;
  for (const auto& picture : pictures)
    for (const Descriptor& descriptor : picture)
      if (i++ % step == 0) points.push_back(descriptor);
  return points;
}

Status check(std::size_t pictures, std::size_t descriptors, const TrainingOptions& options) {
  const auto refuse = [](const std::string& what) { return Status(Reason::INVALID_ARGUMENT, what); };
  if (options.words < 1 || options.words > kMaxWords) return refuse("words outside 1.." + std::to_string(kMaxWords));
  if (options.sample_places < 1 || options.sample_places > kMaxSamplePlaces)
    return refuse("sample places outside 1.." + std::to_string(kMaxSamplePlaces));
  if (options.source.size() > kMaxSourceBytes) return refuse("source text over 4096 bytes");
  if (pictures < options.sample_places)
    return refuse(std::to_string(pictures) + " pictures for " + std::to_string(options.sample_places) +
                  " sample places");
  if (descriptors < 10 * options.words)
    return refuse(std::to_string(descriptors) + " descriptors for " + std::to_string(options.words) +
                  " words; 10 a word are needed");
  return {};
}

}  // namespace

Result<VocabularyModel> train_vocabulary(std::span<const std::vector<Descriptor>> pictures,
                                         const TrainingOptions& options, const TrainingProgress& progress) {
  std::size_t total = 0;
  for (const auto& picture : pictures) total += picture.size();
  if (const Status status = check(pictures.size(), total, options); !status.ok()) return status;
  const auto tell = [&](std::string_view stage) {
    return [&progress, stage](double share) {
      if (progress) progress(stage, share);
    };
  };

  VocabularyModel model;
  model.source = options.source;
  const auto points = choose_points(pictures, total, std::max(options.max_points, 10 * options.words));
  WordTree tree = cluster_words(points, options.words, options.seed, tell("words"));
  model.branches = std::move(tree.branches);
  model.branch_begin = std::move(tree.branch_begin);
  model.centroids = std::move(tree.centroids);

  // The words of documents are found in the way in which maps and queries find theirs.
  std::vector<std::vector<std::uint32_t>> documents;
  const WordSearch search(model.branches, model.branch_begin, model.centroids);
  for (const auto& picture : pictures) {
    std::vector<std::uint32_t> words;
    for (const Descriptor& descriptor : picture) words.push_back(search.nearest(descriptor));
    documents.push_back(sorted_unique(words));
    tell("documents")(static_cast<double>(documents.size()) / static_cast<double>(pictures.size()));
  }

  ChowLiuTree dependence = learn_chow_liu(documents, static_cast<std::uint32_t>(model.centroids.size()), tell("tree"));
  model.parent = std::move(dependence.parent);
  model.marginal = std::move(dependence.marginal);
  model.given_parent_absent = std::move(dependence.given_parent_absent);
  model.given_parent_present = std::move(dependence.given_parent_present);

  for (std::size_t i = 0; i < options.sample_places; ++i)
    model.sample_places.push_back(documents[i * documents.size() / options.sample_places]);
  return model;
}

}  // namespace relmap::place
