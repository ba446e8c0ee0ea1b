#include "server/place/place_block.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace relmap::place {
namespace {

constexpr std::size_t kBlockHeaderBytes = 16;
constexpr std::size_t kRunBytes = 12;
constexpr LogLikelihood kMaxConstant = LogLikelihood{1} << 61;

std::size_t to_multiple_of_8(std::size_t bytes) { return (bytes + 7) / 8 * 8; }

Status corrupt_block(const std::string& what) { return {Reason::CORRUPT, "a block of places has " + what}; }

bool is_bitmap(std::size_t slots, std::size_t places) {
  return slots * sizeof(std::uint16_t) > PlaceBlock::bitmap_bytes(static_cast<std::uint32_t>(places));
}

bool is_list(const PlaceBlock::List& list, std::uint32_t places) {
  if (list.bitmap ? list.size != PlaceBlock::bitmap_bytes(places) : list.size % 2 != 0) return false;
  std::int64_t before = -1;
  std::size_t count = 0;
  bool good = true;
  for_each_slot(list, [&](std::uint32_t slot) {
    good = good && slot > before && slot < places;
    before = slot;
    ++count;
  });
  return good && list.bitmap == is_bitmap(count, places);
}

// The runs of the older and newer frames in order, and the slot of each frame.
struct FrameOrder {
  FrameOrder(const PlaceBlock* older, std::span<const PlaceWords> newer)
      : of_older(older ? older->places() : 0), of_newer(newer.size()) {
    struct Source {
      FrameId frame;
      std::uint32_t* slot;
    };
    std::vector<Source> sources;
    sources.reserve(of_older.size() + of_newer.size());
    if (older)
      for (const FrameRun& run : older->frames())
        for (std::uint32_t i = 0; i < run.count; ++i)
          sources.push_back({{run.first.session, run.first.index + i}, &of_older[run.place + i]});
    for (std::size_t i = 0; i < newer.size(); ++i) sources.push_back({newer[i].frame, &of_newer[i]});
    std::sort(sources.begin(), sources.end(), [](const Source& x, const Source& y) { return x.frame < y.frame; });
    for (std::uint32_t slot = 0; slot < sources.size(); ++slot) {
      const FrameId frame = sources[slot].frame;
      *sources[slot].slot = slot;
      if (!runs.empty() && runs.back().first.session == frame.session &&
          std::uint64_t{runs.back().first.index} + runs.back().count == frame.index)
        ++runs.back().count;
      else
        runs.push_back({frame, 1, slot});
    }
  }
  std::vector<std::uint32_t> of_older, of_newer;  // slots
  std::vector<FrameRun> runs;
};

// The lists of slots by word of the newer places.
class NewLists {
 public:
  NewLists(std::uint32_t vocabulary_size, std::span<const PlaceWords> places, const std::vector<std::uint32_t>& slots)
      : begin_(vocabulary_size + std::size_t{1}) {
    std::vector<std::uint32_t> order(places.size());  // by slot
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::uint32_t x, std::uint32_t y) { return slots[x] < slots[y]; });
    const auto each = [&](auto visit) {
      for (const std::uint32_t i : order)
        for (const std::uint32_t word : places[i].words) visit(word, slots[i]);
    };
    each([&](std::uint32_t word, std::uint32_t) { ++begin_[word + 1]; });
    for (std::size_t word = 1; word < begin_.size(); ++word) begin_[word] += begin_[word - 1];
    slots_.resize(begin_.back());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    each([&](std::uint32_t word, std::uint32_t slot) { slots_[next[word]++] = static_cast<std::uint16_t>(slot); });
  }
  std::span<const std::uint16_t> list(std::uint32_t word) const {
    return std::span(slots_).subspan(begin_[word], begin_[word + 1] - begin_[word]);
  }

 private:
  std::vector<std::uint32_t> begin_;
  std::vector<std::uint16_t> slots_;
};

void put_bitmap(const std::vector<std::uint16_t>& slots, std::size_t places, ByteWriter& lists) {
  std::array<std::uint8_t, kPlacesPerBlock / 8> bitmap{};
  for (const std::uint16_t slot : slots) bitmap[slot / 8] |= static_cast<std::uint8_t>(1u << slot % 8);
  lists.put_array(bitmap.data(), PlaceBlock::bitmap_bytes(static_cast<std::uint32_t>(places)));
}

}  // namespace

bool PlaceBlock::lay_out(ByteSpan bytes) {
  if (bytes.size() < kBlockHeaderBytes) return false;
  const std::uint8_t* at = bytes.data();
  places_ = load<std::uint32_t>(at);
  words_ = load<std::uint32_t>(at + 4);
  runs_ = load<std::uint32_t>(at + 8);
  frames_ = at + kBlockHeaderBytes;
  constants_ = frames_ + to_multiple_of_8(runs_ * kRunBytes);
  offsets_ = constants_ + std::size_t{places_} * 8;
  lists_ = offsets_ + (std::size_t{words_} + 1) * 4;
  return true;
}

PlaceBlock PlaceBlock::trusted(ByteSpan bytes) {
  PlaceBlock block;
  block.lay_out(bytes);
  return block;
}

Result<PlaceBlock> PlaceBlock::parse(ByteSpan bytes, std::uint32_t vocabulary_size) {
  if (bytes.size() < kBlockHeaderBytes) return corrupt_block("a truncated header");
  const auto field = [&](std::size_t i) { return load<std::uint32_t>(bytes.data() + 4 * i); };
  const std::uint32_t places = field(0), runs = field(2), list_bytes = field(3);
  if (places == 0 || places > kPlacesPerBlock || field(1) != vocabulary_size || runs == 0 || runs > places ||
      (list_bytes & kBitmap) != 0)
    return corrupt_block("an invalid header");
  const std::size_t size = kBlockHeaderBytes + to_multiple_of_8(runs * kRunBytes) + std::size_t{places} * 8 +
                           (std::size_t{vocabulary_size} + 1) * 4 + list_bytes;
  if (bytes.size() != size) return corrupt_block("the wrong size");

  const PlaceBlock block = trusted(bytes);
  std::uint32_t place = 0;
  std::uint64_t next = 0;  // the lowest frame that may come next, packed
  for (const FrameRun& run : block.frames()) {
    if (run.first.packed() < next || !run.first.valid() || run.count == 0 || run.count > places - place ||
        std::uint64_t{run.first.index} + run.count > std::uint64_t{1} << 32)
      return corrupt_block("invalid frames");
    place += run.count;
    next = run.first.packed() + run.count;
  }
  if (place != places) return corrupt_block("the wrong number of frames");
  for (std::uint32_t slot = 0; slot < places; ++slot)
    if (block.constant(slot) < -kMaxConstant || block.constant(slot) > kMaxConstant)
      return corrupt_block("invalid constants");
  for (std::uint32_t word = 0; word < block.words_; ++word) {
    const auto from = load<std::uint32_t>(block.offsets_ + 4 * std::size_t{word}) & ~kBitmap;
    const auto to = load<std::uint32_t>(block.offsets_ + 4 * (std::size_t{word} + 1)) & ~kBitmap;
    if (from > to || to > list_bytes || !is_list(block.list(word), places))
      return corrupt_block("an invalid list of word " + std::to_string(word));
  }
  if (load<std::uint32_t>(block.offsets_ + 4 * std::size_t{block.words_}) != list_bytes)
    return corrupt_block("lists that end at the wrong offset");
  return block;
}

std::vector<FrameRun> PlaceBlock::frames() const {
  std::vector<FrameRun> runs;
  runs.reserve(runs_);
  std::uint32_t place = 0;
  for (std::uint32_t i = 0; i < runs_; ++i) {
    const std::uint8_t* at = frames_ + i * kRunBytes;
    const auto count = load<std::uint32_t>(at + 8);
    runs.push_back({{load<std::uint32_t>(at), load<std::uint32_t>(at + 4)}, count, place});
    place += count;
  }
  return runs;
}

Bytes encode_place_block(const FabMapModel& model, const PlaceBlock* older, std::span<const PlaceWords> newer) {
  const FrameOrder order(older, newer);
  const std::size_t places = order.of_older.size() + newer.size();
  assert(places > 0 && places <= kPlacesPerBlock);

  std::vector<LogLikelihood> constants(places);
  for (std::uint32_t slot = 0; slot < order.of_older.size(); ++slot)
    constants[order.of_older[slot]] = older->constant(slot);
  for (std::size_t i = 0; i < newer.size(); ++i) constants[order.of_newer[i]] = model.place(newer[i].words);

  ByteWriter lists;
  std::vector<std::uint32_t> offsets;
  offsets.reserve(model.size() + std::size_t{1});
  const NewLists fresh(model.size(), newer, order.of_newer);
  std::vector<std::uint16_t> from_older, slots;
  for (std::uint32_t word = 0; word < model.size(); ++word) {
    from_older.clear();
    slots.clear();
    if (older)
      for_each_slot(older->list(word), [&](std::uint32_t slot) {
        from_older.push_back(static_cast<std::uint16_t>(order.of_older[slot]));
      });
    const auto added = fresh.list(word);
    std::merge(from_older.begin(), from_older.end(), added.begin(), added.end(), std::back_inserter(slots));
    const auto offset = static_cast<std::uint32_t>(lists.size());
    if (is_bitmap(slots.size(), places)) {
      offsets.push_back(offset | PlaceBlock::kBitmap);
      put_bitmap(slots, places, lists);
    } else {
      offsets.push_back(offset);
      lists.put_array(slots.data(), slots.size());
    }
  }
  offsets.push_back(static_cast<std::uint32_t>(lists.size()));

  ByteWriter w;
  w.reserve(kBlockHeaderBytes + to_multiple_of_8(order.runs.size() * kRunBytes) + constants.size() * 8 +
            offsets.size() * 4 + lists.size());
  w.put(static_cast<std::uint32_t>(places));
  w.put(model.size());
  w.put(static_cast<std::uint32_t>(order.runs.size()));
  w.put(static_cast<std::uint32_t>(lists.size()));
  for (const FrameRun& run : order.runs) {
    w.put(run.first.session);
    w.put(run.first.index);
    w.put(run.count);
  }
  while (w.size() % 8 != 0) w.put(std::uint8_t{0});
  w.put_array(constants.data(), constants.size());
  w.put_array(offsets.data(), offsets.size());
  w.put_bytes(lists.bytes());
  return w.take();
}

}  // namespace relmap::place
