// The places of the map by the words seen there: blocks of 4,096 that do not change any more, in memory as far as there
// is room and else in a file; one that is not full yet; and the last few places as they came.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <shared_mutex>
#include <span>
#include <string>
#include <vector>

#include "server/place/block_scores.h"
#include "server/place/frame_table.h"
#include "server/place/place_block.h"
#include "server/place/place_file.h"
#include "storage/graph/frame_range.h"

namespace relmap::place {

// What stands in blocks. Immutable.
struct PackedPlaces {
  struct Block {
    PlaceFile::Extent extent;            // of no size: it stands in memory only
    std::shared_ptr<const Bytes> bytes;  // null: it stands in the file only
  };
  std::vector<Block> blocks;  // all full, but for the last
  FrameTable frames;
  std::shared_ptr<const PlaceFile> file;
};

// A place that is no candidate and no part of the sum.
inline constexpr LogLikelihood kLeftOut = std::numeric_limits<LogLikelihood>::min();

// One query's log-likelihoods at the places that the index held when it was asked. Kept from query to query for its
// memory.
struct PlaceScores {
  std::uint32_t find(FrameId frame) const;  // FrameTable::kNone
  FrameId frame(std::uint32_t place) const;
  std::span<const LogLikelihood> of_block(std::size_t block) const {
    const std::size_t begin = block * kPlacesPerBlock;
    return std::span(values).subspan(begin, std::min<std::size_t>(kPlacesPerBlock, values.size() - begin));
  }

  std::vector<LogLikelihood> values;   // by place; kLeftOut where masked
  std::vector<LogLikelihood> highest;  // by block
  std::size_t candidates = 0;          // places that are not masked

  std::shared_ptr<const PackedPlaces> packed;
  std::vector<FrameId> tail;  // of the places beyond
  Bytes page;                 // a block read from the file
};

// One writer, any number of readers.
class InvertedIndex {
 public:
  struct Options {
    std::size_t allowance = std::numeric_limits<std::size_t>::max();  // bytes of memory, a query's scores among them
    std::string folder;                                               // the data folder; empty: in memory only
    std::uint32_t vocabulary_crc = 0;
  };
  InvertedIndex(const FabMapModel& model, Options options);

  // The writer's. `words` sorted and unique; the frame is not there yet. IO_ERROR, DISK_FULL (the file takes nothing),
  // BUDGET_EXCEEDED: it is left out.
  Status add(FrameId frame, std::vector<std::uint32_t> words);
  bool contains(FrameId frame) const;
  // Takes over what stands in the file, of an index without places. Not ok: why not all of it could be used; the rest
  // is cut off.
  Status restore(const std::function<bool(const FrameRun&)>& in_map);
  // All places into the file. IO_ERROR, DISK_FULL.
  Status save();

  // `query` has been asked. Throws StatusError where a block cannot be read (IO_ERROR, DATA_LOSS).
  void score(BlockScores& query, std::span<const storage::FrameRange> masked, PlaceScores& scores) const;

  std::uint32_t size() const;
  std::size_t memory_bytes() const;  // with a query under way

 private:
  Status make_room();
  Status write_blocks();
  Status open_file(Status* emptied);
  void pack();
  void publish(PackedPlaces packed);
  std::size_t memory_now() const;
  std::uint32_t unfilled() const { return packed_->frames.places() % kPlacesPerBlock; }  // places of the last block

  const FabMapModel& model_;
  const Options options_;
  std::shared_ptr<PlaceFile> file_;  // null: it could not be opened, or there is to be none

  mutable std::shared_mutex mutex_;  // guards what follows; the writer, who alone changes it, reads without
  std::shared_ptr<const PackedPlaces> packed_ = std::make_shared<const PackedPlaces>();
  std::vector<PlaceWords> tail_;
  std::vector<LogLikelihood> tail_constants_;

  std::atomic<std::size_t> memory_ = 0;
  std::size_t resident_bytes_ = 0, max_block_ = 0, tail_bytes_ = 0;
  std::uint32_t refused_ = 0;  // places, since the disk was tried
};

// `words` sorted, each once.
std::vector<std::uint32_t> sorted_unique(std::span<const std::uint32_t> words);

}  // namespace relmap::place
