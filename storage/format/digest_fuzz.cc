// Any bytes as the record of a chunk's digests: as it is, sealed, and as the entry of one frame. What can be read can
// be written, and is then the same; entries that are copied are as they were.
#include <vector>

#include "proto/base/testing/fuzzing.h"
#include "storage/format/digest_codec.h"
#include "storage/format/sealed.h"

namespace {

using namespace relmap;
using namespace relmap::storage;
using fuzzing::must;

constexpr ChunkId kChunk{3, 9};

void read_record(ByteSpan record) {
  ChunkDigest digests;
  const Status read = decode_digests(record, kChunk, digests);
  const auto packed = unpack_digests(record, kChunk);
  if (!read.ok()) {
    must(fuzzing::is_one_of(read.reason(), {Reason::TRUNCATED, Reason::CORRUPT, Reason::UNKNOWN_FORMAT_VERSION}));
    return;
  }
  must(packed.ok() && digests.id == kChunk);
  DigestWriter again(kChunk, packed->time_us), copied(kChunk, packed->time_us);
  std::uint32_t next = 0;
  for (const FrameDigest& frame : digests.frames) {
    must(frame.slot >= next && !packed->entries[frame.slot].empty());
    next = frame.slot + 1;
    again.add(frame);
    copied.copy(frame.slot, packed->entries[frame.slot], packed->has_closures(frame.slot));
  }
  ChunkDigest twice, copies;
  must(decode_digests(again.finish(), kChunk, twice).ok() && decode_digests(copied.finish(), kChunk, copies).ok());
  must(twice.frames.size() == digests.frames.size() && copies.frames.size() == digests.frames.size());
  for (std::size_t i = 0; i < twice.frames.size(); ++i) {
    must(agree(as_stored(frame_in(kChunk, digests.frames[i].slot), digests.frames[i]), twice.frames[i]));
    must(agree(digests.frames[i], copies.frames[i]));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan bytes(data, size);
  read_record(bytes);
  read_record(seal(8, 1, bytes));
  if (size == 0) return 0;
  DigestWriter writer(kChunk, 1'700'000'000'000'000);
  writer.copy(data[0] % kFramesPerChunk, bytes, size % 2 == 0);
  read_record(writer.finish());
  return 0;
}
