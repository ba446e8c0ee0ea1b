// The visual vocabulary with its Chow-Liu tree (docs/method.md, 7; Cummins and Newman, IJRR 2008), which is a binary
// file that is memory-mapped.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::place {

// Immutable and thread-safe.
class Vocabulary {
 public:
  virtual ~Vocabulary() = default;

  // Maps a vocabulary file. NO_SUCH_FILE, CORRUPT, UNKNOWN_FORMAT_VERSION.
  static Result<std::shared_ptr<const Vocabulary>> load(const std::string& path);
  // The same from the bytes of a file.
  static Result<std::shared_ptr<const Vocabulary>> from_bytes(Bytes bytes);

  virtual std::uint32_t size() const = 0;  // words
  virtual std::uint32_t crc() const = 0;   // checksum of the whole file, which identifies the vocabulary
  virtual std::string source() const = 0;  // what it was trained on, and under which terms

  // The word of each feature: the nearest centroid among the words of the 8 branches nearest to the feature.
  virtual std::vector<std::uint32_t> words(std::span<const AppearanceFeature> features) const = 0;

  // The descriptor that stands for the word.
  virtual const std::array<std::uint8_t, 128>& centroid(std::uint32_t word) const = 0;

  // For each word: p(z = 1), its parent in the tree (the root is its own), and p(z = 1) given that the parent is absent
  // or present.
  virtual std::span<const float> marginal() const = 0;
  virtual std::span<const std::uint32_t> parent() const = 0;
  virtual std::span<const float> given_parent_absent() const = 0;
  virtual std::span<const float> given_parent_present() const = 0;

  // Sample places, which stand for the unknown world in the probability of a new place: the sorted words of each.
  virtual std::size_t sample_places() const = 0;
  virtual std::span<const std::uint32_t> sample_place(std::size_t i) const = 0;
};

// The path of the vocabulary that is shipped with the programs: ../share/relmap/default.vocab relative to the folder of
// the running executable.
std::string default_vocabulary_path();

}  // namespace relmap::place
