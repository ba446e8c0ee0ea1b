#include "server/place/inverted_index.h"

#include "proto/base/mutex.h"

namespace relmap::place {
namespace {

constexpr std::uint32_t kTail = 256;          // places that may be in no block; they are scored word by word
constexpr std::size_t kAddBytes = 32 * 1024;  // memory of one new place, at most
constexpr std::size_t kQueryBytes = 9;        // memory of a query for each place: its score, and an eighth for growth
constexpr std::uint32_t kPatience = 256;      // places that are refused before a full disk is tried again

// Consecutive masked places, [first, last).
struct PlaceRange {
  std::uint32_t first, last;
};

std::vector<PlaceRange> places_of(const FrameTable& frames, std::span<const storage::FrameRange> ranges) {
  std::vector<PlaceRange> places;
  const auto& runs = frames.by_frame();
  for (const storage::FrameRange& range : ranges) {
    auto run = std::partition_point(runs.begin(), runs.end(), [&](const FrameRun& r) {
      return r.first.packed() + r.count <= FrameId{range.session, range.first}.packed();
    });
    for (; run != runs.end() && run->first.session == range.session && run->first.index <= range.last; ++run) {
      const std::uint32_t from = std::max(range.first, run->first.index) - run->first.index;
      const std::uint32_t to = std::min(range.last - run->first.index, run->count - 1);
      places.push_back({run->place + from, run->place + to + 1});
    }
  }
  std::sort(places.begin(), places.end(), [](const PlaceRange& x, const PlaceRange& y) { return x.first < y.first; });
  std::size_t kept = 0;
  for (const PlaceRange& range : places)
    if (kept > 0 && range.first <= places[kept - 1].last)
      places[kept - 1].last = std::max(places[kept - 1].last, range.last);
    else
      places[kept++] = range;
  places.resize(kept);
  return places;
}

std::size_t bytes_of(const PlaceWords& place) {
  return sizeof place + sizeof(LogLikelihood) + place.words.capacity() * sizeof(place.words[0]) + 6 * sizeof(void*);
}

}  // namespace

std::uint32_t PlaceScores::find(FrameId frame) const {
  if (const std::uint32_t place = packed->frames.find(frame); place != FrameTable::kNone) return place;
  const auto found = std::find(tail.begin(), tail.end(), frame);
  if (found == tail.end()) return FrameTable::kNone;
  return packed->frames.places() + static_cast<std::uint32_t>(found - tail.begin());
}

FrameId PlaceScores::frame(std::uint32_t place) const {
  const std::uint32_t in_blocks = packed->frames.places();
  return place < in_blocks ? packed->frames.frame(place) : tail[place - in_blocks];
}

InvertedIndex::InvertedIndex(const FabMapModel& model, Options options) : model_(model), options_(std::move(options)) {
  memory_ = memory_now();
}

bool InvertedIndex::contains(FrameId frame) const {
  const auto& tail = writers_tail();
  return writers_packed().frames.find(frame) != FrameTable::kNone ||
         std::any_of(tail.begin(), tail.end(), [&](const auto& one) { return one->place.frame == frame; });
}

Status InvertedIndex::add(FrameId frame, std::vector<std::uint32_t> words) {
  if (Status room = make_room(); !room.ok()) {
    ++refused_;
    return room;
  }
  const LogLikelihood constant = model_.place(words);
  auto added = std::make_shared<const TailPlace>(TailPlace{{frame, std::move(words)}, constant});
  const std::size_t bytes = bytes_of(added->place);
  {
    const ExclusiveLock lock(mutex_);
    tail_.push_back(std::move(added));
  }
  tail_bytes_ += bytes;
  memory_ = memory_now();
  if (writers_tail().size() >= std::min(kTail, kPlacesPerBlock - unfilled())) pack();
  return {};
}

// Moves the tail into the last block, and writes the block to the file once it is full.
void InvertedIndex::pack() {
  std::vector<PlaceWords> tail;
  for (const auto& one : writers_tail()) tail.push_back(one->place);
  if (tail.empty()) return;
  PackedPlaces packed = writers_packed();
  Bytes bytes;
  if (unfilled() == 0) {
    bytes = encode_place_block(model_, nullptr, tail);
  } else {
    const auto older = std::move(packed.blocks.back().bytes);
    packed.blocks.pop_back();
    packed.frames.truncate(packed.frames.places() - unfilled());
    const PlaceBlock block = PlaceBlock::trusted(*older);
    bytes = encode_place_block(model_, &block, tail);
    resident_bytes_ -= older->size();
  }
  packed.frames.append(PlaceBlock::trusted(bytes).frames());
  resident_bytes_ += bytes.size();
  max_block_ = std::max(max_block_, bytes.size());
  packed.blocks.push_back({{}, std::make_shared<const Bytes>(std::move(bytes))});
  {
    auto shared = std::make_shared<const PackedPlaces>(std::move(packed));
    const ExclusiveLock lock(mutex_);
    packed_.swap(shared);
    tail_.clear();
  }
  tail_bytes_ = 0;
  memory_ = memory_now();
  // If this fails, make_room() or the next full block tries again.
  if (unfilled() == 0) (void)write_blocks();
}

void InvertedIndex::publish(PackedPlaces packed) {
  auto shared = std::make_shared<const PackedPlaces>(std::move(packed));
  {
    const ExclusiveLock lock(mutex_);
    packed_.swap(shared);
  }
  memory_ = memory_now();
}

Status InvertedIndex::open_file(Status* emptied) {
  if (file_) return {};
  auto file = PlaceFile::open(options_.folder, options_.vocabulary_crc, emptied);
  if (!file.ok()) return file.status();
  file_ = std::move(file).value();
  PackedPlaces packed = writers_packed();
  packed.file = file_;
  publish(std::move(packed));
  return {};
}

// Writes the full blocks that are in memory only.
Status InvertedIndex::write_blocks() {
  if (options_.folder.empty()) return {};
  Status emptied;
  if (Status opened = open_file(&emptied); !opened.ok()) return opened;
  PackedPlaces packed = writers_packed();
  const std::size_t full = packed.frames.places() / kPlacesPerBlock;
  Status status;
  for (std::size_t i = 0; i < full; ++i) {
    auto& block = packed.blocks[i];
    if (block.extent.size > 0) continue;
    const auto extent = file_->write(i == 0 ? PlaceFile::kBegin : packed.blocks[i - 1].extent.end(), *block.bytes);
    if (!extent.ok()) {
      status = extent.status();
      break;
    }
    block.extent = *extent;
  }
  publish(std::move(packed));
  return status;
}

Status InvertedIndex::save() {
  if (size() == 0) return {};
  pack();
  if (Status written = write_blocks(); !written.ok()) return written;
  if (options_.folder.empty() || unfilled() == 0) return {};
  const auto& blocks = writers_packed().blocks;
  const std::uint64_t at = blocks.size() == 1 ? PlaceFile::kBegin : blocks[blocks.size() - 2].extent.end();
  return file_->write(at, *blocks.back().bytes).status();
}

Status InvertedIndex::restore(const std::function<bool(const FrameRun&)>& in_map) {
  if (options_.folder.empty()) return {};
  Status why;
  if (Status opened = open_file(&why); !opened.ok()) return opened;
  PackedPlaces packed = writers_packed();
  std::uint64_t offset = PlaceFile::kBegin;
  for (bool last = false;;) {
    Bytes bytes;
    const auto extent = file_->read_next(offset, bytes);
    if (!extent.ok()) {
      if (extent.status().reason() != Reason::NO_SUCH_FILE) why = extent.status();
      break;
    }
    const auto block = PlaceBlock::parse(bytes, model_.size());
    why = block.ok() && last ? Status(Reason::CORRUPT, file_->path() + " continues after its last block")
                             : block.status();
    if (!why.ok()) break;
    const std::vector<FrameRun> frames = block->frames();
    if (!std::all_of(frames.begin(), frames.end(), in_map) || !packed.frames.append(frames)) {
      why = {Reason::NO_SUCH_FRAME, file_->path() + " holds frames that the map does not hold, or a frame twice"};
      break;
    }
    last = block->places() < kPlacesPerBlock;
    offset = extent->end();
    max_block_ = std::max(max_block_, bytes.size());
    packed.blocks.push_back({last ? PlaceFile::Extent{} : *extent, nullptr});
    if (last || memory_now() + bytes.size() + max_block_ + kAddBytes < options_.allowance / 8 * 7) {
      resident_bytes_ += bytes.size();
      packed.blocks.back().bytes = std::make_shared<const Bytes>(std::move(bytes));
    }
  }
  publish(std::move(packed));
  if (!why.ok()) (void)file_->cut(offset);
  return why;
}

// Drops blocks that are in the file from memory, oldest first, until a new place has room.
Status InvertedIndex::make_room() {
  const auto fits = [&] { return memory_ + kAddBytes <= options_.allowance; };
  if (fits()) return {};
  Status written;
  if (refused_ % kPatience == 0) written = write_blocks();
  PackedPlaces packed = writers_packed();
  for (auto& block : packed.blocks) {
    if (memory_now() + kAddBytes + max_block_ <= options_.allowance) break;
    if (!block.bytes || block.extent.size == 0) continue;
    resident_bytes_ -= block.bytes->size();
    block.bytes = nullptr;
  }
  publish(std::move(packed));
  if (fits()) {
    refused_ = 0;
    return {};
  }
  if (!written.ok()) return written;
  return {Reason::BUDGET_EXCEEDED, "the place index fills its share of " + std::to_string(options_.allowance) +
                                       " bytes with " + std::to_string(size()) + " places"};
}

void InvertedIndex::score(BlockScores& query, std::span<const storage::FrameRange> masked, PlaceScores& scores) const {
  std::vector<std::shared_ptr<const TailPlace>> tail;
  {
    const SharedLock lock(mutex_);
    scores.packed = packed_;
    tail = tail_;
  }
  scores.tail.clear();
  std::vector<LogLikelihood> of_tail;
  for (const auto& one : tail) {
    scores.tail.push_back(one->place.frame);
    of_tail.push_back(storage::within(one->place.frame, masked) ? kLeftOut
                                                                : query.of_words(one->constant, one->place.words));
  }
  const std::uint32_t packed = scores.packed->frames.places();
  const std::size_t size = packed + of_tail.size();
  if (scores.values.capacity() < size) {
    scores.values = {};
    scores.values.reserve(size + size / 8);
  }
  scores.values.resize(size);
  std::copy(of_tail.begin(), of_tail.end(), scores.values.begin() + packed);
  const std::vector<PlaceRange> left_out = places_of(scores.packed->frames, masked);
  auto next_left_out = left_out.begin();
  scores.highest.clear();
  scores.candidates = size - static_cast<std::size_t>(std::count(of_tail.begin(), of_tail.end(), kLeftOut));
  for (std::uint32_t begin = 0; begin < size; begin += kPlacesPerBlock) {
    const auto end = static_cast<std::uint32_t>(std::min<std::size_t>(size, begin + kPlacesPerBlock));
    if (begin < packed) {
      const PackedPlaces::Block& block = scores.packed->blocks[begin / kPlacesPerBlock];
      if (!block.bytes)
        if (Status read = scores.packed->file->read(block.extent, scores.page); !read.ok()) throw StatusError(read);
      query.of_block(PlaceBlock::trusted(block.bytes ? *block.bytes : scores.page), scores.values.data() + begin);
    }
    while (next_left_out != left_out.end() && next_left_out->last <= begin) ++next_left_out;
    for (auto range = next_left_out; range != left_out.end() && range->first < end; ++range)
      for (std::uint32_t i = std::max(begin, range->first); i < std::min(end, range->last); ++i) {
        scores.candidates -= scores.values[i] != kLeftOut;
        scores.values[i] = kLeftOut;
      }
    LogLikelihood highest = kLeftOut;
    for (const LogLikelihood value : scores.of_block(begin / kPlacesPerBlock)) highest = std::max(highest, value);
    scores.highest.push_back(highest);
  }
}

std::uint32_t InvertedIndex::size() const {
  const SharedLock lock(mutex_);
  return packed_->frames.places() + static_cast<std::uint32_t>(tail_.size());
}

std::size_t InvertedIndex::memory_bytes() const { return memory_; }

// Memory in use, plus what may be needed besides: a block that is being made from the tail, and of each query the
// scores and a block that it reads.
std::size_t InvertedIndex::memory_now() const {
  const PackedPlaces& packed = writers_packed();
  const std::size_t places = packed.frames.places() + writers_tail().size();
  return resident_bytes_ + tail_bytes_ + options_.queries * (places * kQueryBytes + max_block_) + max_block_ +
         2 * packed.frames.memory_bytes() + 2 * packed.blocks.size() * sizeof(PackedPlaces::Block);
}

std::vector<std::uint32_t> sorted_unique(std::span<const std::uint32_t> words) {
  std::vector<std::uint32_t> result(words.begin(), words.end());
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace relmap::place
