// Any bytes as the body of a frame in every part, and as a container: as it is, with the checksum of its header
// corrected, and as the bodies of frames for which the containers are written, so that what is behind the checksums is
// reached. A frame of the latter is a byte by which its slot is behind the one before, a u16 length, and its body.
#include <algorithm>
#include <memory>
#include <vector>

#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/format/chunk_codec.h"
#include "storage/format/frame_codec.h"
#include "storage/format/packed_part.h"

namespace {

using namespace relmap;
using namespace relmap::storage;
using fuzzing::must;

constexpr FrameId kId{3, 577};  // the frame of the bodies
constexpr ChunkId kChunk{3, 9};
constexpr std::uint64_t kCommit = 12;

// What decodes must encode to bytes that decode to the same again.
template <typename Decode, typename Encode>
void round_trip(ByteSpan body, Decode decode, Encode encode) {
  const auto frame = decode(body);
  if (!frame) return;
  ByteWriter once;
  encode(once, *frame);
  const auto again = decode(once.bytes());
  must(again.has_value());
  ByteWriter twice;
  encode(twice, *again);
  must(twice.bytes() == once.bytes());
}

void try_body(ByteSpan body) {
  round_trip(
      body, [](ByteSpan b) { return decode_hot(b, kId); },
      [](ByteWriter& w, const FrameHot& f) { encode_hot(w, kId, f); });
  round_trip(
      body, [](ByteSpan b) { return decode_warm(b, kId); },
      [](ByteWriter& w, const FrameWarm& f) { encode_warm(w, kId, f); });
  round_trip(body, decode_cold, encode_cold);
  round_trip(body, decode_words, encode_words);
}

// A container gives each frame or says that it is lost, whether frames are asked for one by one or together.
template <typename Frame>
void read_packed(const Bytes& container) {
  static const auto kBudget = std::make_shared<Budget>(std::size_t{256} << 20);
  typename PackedPart<Frame>::Records records;
  std::uint64_t commit = 0;
  const Status read = unpack<Frame>(std::make_shared<const Bytes>(container), kChunk, records, &commit);
  must(read.ok() == PartReader::open(container, kPartOf<Frame>, kChunk).ok());
  if (!read.ok()) records[0].damage = std::make_shared<const Status>(read);
  {
    const PackedPart<Frame> part(kBudget, kChunk, records);
    std::uint64_t given = 0;
    bool any = false, all = true;
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
      const bool there = part.record(slot).there();
      any = any || there;
      try {
        must((part.frame(slot) != nullptr) == there);
        given |= std::uint64_t{1} << slot;
      } catch (const StatusError& error) {
        must(there && error.status().reason() == Reason::DATA_LOSS);
        all = false;
      }
    }
    must(part.empty() == !any && part.id() == kChunk && (!all || part.sound()));
    const auto frames = part.frames(given);
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
      if ((given >> slot & 1) != 0) must(frames[slot] == part.frame(slot));
    try {
      (void)part.frames(~std::uint64_t{0});
      must(all);
    } catch (const StatusError&) {
      must(!all);
    }
  }
  must(kBudget->used() == 0);
}

void read_container(const Bytes& container) {
  read_packed<FrameHot>(container);
  read_packed<FrameWarm>(container);
  for (const Part part : {Part::kHot, Part::kWarm}) {
    const auto reader = PartReader::open(container, part, kChunk);
    if (!reader.ok()) {
      must(fuzzing::is_one_of(reader.reason(), {Reason::TRUNCATED, Reason::CORRUPT, Reason::UNKNOWN_FORMAT_VERSION}));
      continue;
    }
    PartWriter copy(part, kChunk, reader->commit());
    for (std::size_t i = 0; i < reader->size(); ++i) {
      copy.copy(reader->slot(i), reader->stored(i), reader->crc(i));
      if (const auto body = reader->body(i); body.ok()) try_body(*body);
    }
    const Bytes copied = copy.finish();
    const auto again = PartReader::open(copied, part, kChunk);
    must(again.ok() && again->size() == reader->size() && again->commit() == reader->commit());
    for (std::size_t i = 0; i < reader->size(); ++i)
      must(again->slot(i) == reader->slot(i) && again->crc(i) == reader->crc(i) &&
           std::ranges::equal(again->stored(i), reader->stored(i)));
  }
}

// Behind the header, which has the number of frames in its eighth byte, and 12 bytes for each of these.
void mend_header(Bytes& container) {
  constexpr std::size_t kHeaderBytes = 32, kEntryBytes = 12;
  if (container.size() < kHeaderBytes) return;
  const std::size_t end = kHeaderBytes + kEntryBytes * container[7];
  if (container.size() < end + sizeof(std::uint32_t)) return;
  const std::uint32_t crc = crc32c(ByteSpan(container).first(end));
  std::memcpy(container.data() + end, &crc, sizeof crc);
}

void write_and_read(ByteReader in) {
  PartWriter hot(Part::kHot, kChunk, kCommit), warm(Part::kWarm, kChunk, kCommit);
  std::uint32_t next = 0;
  while (in.remaining() > 0 && next < kFramesPerChunk) {
    const std::uint32_t slot = std::min(next + in.get<std::uint8_t>() % 8u, kFramesPerChunk - 1);
    const ByteSpan body = fuzzing::take_up_to(in, in.get<std::uint16_t>());
    hot.add(slot, body);
    warm.add(slot, body);
    next = slot + 1;
    const Bytes one = frame_container(Part::kHot, frame_in(kChunk, slot), kCommit, body);
    const auto reader = PartReader::open(one, Part::kHot, kChunk);
    must(reader.ok() && reader->size() == 1 && reader->slot(0) == slot && reader->commit() == kCommit);
    must(std::ranges::equal(reader->body(0).or_throw(), body));
  }
  read_container(hot.finish());
  read_container(warm.finish());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan bytes(data, size);
  try_body(bytes);
  Bytes container(bytes.begin(), bytes.end());
  read_container(container);
  mend_header(container);
  read_container(container);
  write_and_read(ByteReader(bytes));
  return 0;
}
