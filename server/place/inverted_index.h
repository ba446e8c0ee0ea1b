// Stores the places of the map by the words seen there: full blocks of 4,096 places, which never change and are in
// memory or, where memory is short, only in a file; one block that is not full yet; and the newest places, in no block
// yet (the tail).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/base/mutex.h"
#include "server/place/block_scores.h"
#include "server/place/frame_table.h"
#include "server/place/place_block.h"
#include "server/place/place_file.h"
#include "storage/graph/frame_range.h"

namespace relmap::place {

// The places that are in blocks. Immutable.
struct PackedPlaces {
  struct Block {
    PlaceFile::Extent extent;            // size 0 if the block is in memory only
    std::shared_ptr<const Bytes> bytes;  // null if the block is in the file only
  };
  std::vector<Block> blocks;  // all full except the last
  FrameTable frames;
  std::shared_ptr<const PlaceFile> file;
};

// The value of a masked place: it is no candidate and no part of the sum.
inline constexpr LogLikelihood kLeftOut = std::numeric_limits<LogLikelihood>::min();

// The log-likelihoods of one query at the places that the index held when it was asked. An object is reused from query
// to query, which saves allocations.
struct PlaceScores {
  // Lets go of the index's places, whose older versions would stay in memory otherwise.
  void end() {
    packed.reset();
    tail.clear();
  }
  std::uint32_t find(FrameId frame) const;  // FrameTable::kNone if the frame has no place
  FrameId frame(std::uint32_t place) const;
  std::span<const LogLikelihood> of_block(std::size_t block) const {
    const std::size_t begin = block * kPlacesPerBlock;
    return std::span(values).subspan(begin, std::min<std::size_t>(kPlacesPerBlock, values.size() - begin));
  }

  std::vector<LogLikelihood> values;   // by place; kLeftOut where masked
  std::vector<LogLikelihood> highest;  // the highest value of each block
  std::size_t candidates = 0;          // places that are not masked

  std::shared_ptr<const PackedPlaces> packed;
  std::vector<FrameId> tail;  // the frames of the places that are in no block yet
  Bytes page;                 // scratch memory for a block that is read from the file
};

// One thread may write while any number read.
class InvertedIndex {
 public:
  struct Options {
    std::size_t allowance = std::numeric_limits<std::size_t>::max();  // bytes of memory, including queries' scores
    std::size_t queries = 1;                                          // at the same time, at most
    std::string folder;                                               // the data folder; empty: in memory only
    std::uint32_t vocabulary_crc = 0;
  };
  InvertedIndex(const FabMapModel& model, Options options);

  // These four are for the writer only.
  // Adds a place. `words` are sorted and unique, and the index does not hold the frame yet. IO_ERROR, DISK_FULL (the
  // file cannot be written) and BUDGET_EXCEEDED: the place is left out.
  Status add(FrameId frame, std::vector<std::uint32_t> words);
  bool contains(FrameId frame) const;
  // Loads the places of the file into an empty index. If some of them cannot be used, the file is cut off at the first
  // such block, and the status says why. `in_map` says whether the map holds all frames of a run.
  Status restore(const std::function<bool(const FrameRun&)>& in_map);
  // Writes all places to the file. IO_ERROR, DISK_FULL.
  Status save();

  // Computes the scores of the query that was given to BlockScores::ask(). Throws StatusError where a block cannot be
  // read (IO_ERROR, DATA_LOSS).
  void score(BlockScores& query, std::span<const storage::FrameRange> masked, PlaceScores& scores) const;

  std::uint32_t size() const;
  std::size_t memory_bytes() const;  // including that of as many queries as may run

 private:
  // A place that is in no block yet. Immutable, so that queries score it without holding up the writer.
  struct TailPlace {
    PlaceWords place;
    LogLikelihood constant;  // FabMapModel::place()
  };

  Status make_room();
  Status write_blocks();
  Status open_file(Status* emptied);
  void pack();
  void publish(PackedPlaces packed);
  std::size_t memory_now() const;
  // Places in the last block if it is not full, or else 0.
  std::uint32_t unfilled() const { return writers_packed().frames.places() % kPlacesPerBlock; }

  // What the writer reads without mutex_, since nobody else changes it. Clang cannot be told that only one thread
  // writes, so it does not check these two.
  const PackedPlaces& writers_packed() const RELMAP_NO_THREAD_SAFETY_ANALYSIS { return *packed_; }
  const std::vector<std::shared_ptr<const TailPlace>>& writers_tail() const RELMAP_NO_THREAD_SAFETY_ANALYSIS {
    return tail_;
  }

  const FabMapModel& model_;
  const Options options_;
  std::shared_ptr<PlaceFile> file_;  // null if it could not be opened or there is no folder

  mutable SharedMutex mutex_;
  std::shared_ptr<const PackedPlaces> packed_ RELMAP_GUARDED_BY(mutex_) = std::make_shared<const PackedPlaces>();
  std::vector<std::shared_ptr<const TailPlace>> tail_ RELMAP_GUARDED_BY(mutex_);

  std::atomic<std::size_t> memory_ = 0;
  // The writer's own.
  std::size_t resident_bytes_ = 0, max_block_ = 0, tail_bytes_ = 0;
  std::uint32_t refused_ = 0;  // places that were left out since the last one that had room
};

// Sorts `words` and removes duplicates.
std::vector<std::uint32_t> sorted_unique(std::span<const std::uint32_t> words);

}  // namespace relmap::place
