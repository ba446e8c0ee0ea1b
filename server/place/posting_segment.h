// Inverted lists that do not change any more, on disk: of the places `first`, `first` + 1, ... for each word those that
// show it. Nothing of them stays in memory.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/place/spill_file.h"

namespace relmap {

// Immutable and thread-safe.
class PostingSegment {
 public:
  // `list(word)`: places, ascending; good until the next call. IO_ERROR, and what `list` says.
  using Lists = std::function<Result<std::span<const std::uint32_t>>(std::uint32_t word)>;
  static Result<std::shared_ptr<const PostingSegment>> write(const std::string& folder, std::uint32_t words,
                                                             std::uint32_t first, std::uint32_t places,
                                                             const Lists& list);
  // One segment of two that follow each other.
  static Result<std::shared_ptr<const PostingSegment>> merge(const std::string& folder, const PostingSegment& older,
                                                             const PostingSegment& newer);

  std::uint32_t first() const { return first_; }
  std::uint32_t places() const { return places_; }

  // Reads lists: holds the segment's directory, 8 bytes a word, for as long as it lives. Throws StatusError (IO_ERROR,
  // DATA_LOSS).
  class Reader {
   public:
    explicit Reader(const PostingSegment& segment);
    // Good until the next call.
    std::span<const std::uint32_t> list(std::uint32_t word);

   private:
    const PostingSegment& segment_;
    std::vector<std::uint64_t> directory_;
    std::vector<std::uint32_t> list_;
  };

 private:
  PostingSegment() = default;
  std::unique_ptr<SpillFile> file_;
  std::uint32_t words_ = 0, first_ = 0, places_ = 0;
  std::uint64_t directory_at_ = 0;
  std::uint32_t directory_crc_ = 0;
};

}  // namespace relmap
