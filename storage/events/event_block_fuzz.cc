// Any bytes as a block of events and as the head of their log: as they are, and with a right checksum, so that what is
// behind it is reached.
#include <cstring>
#include <vector>

#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/events/event_block.h"
#include "storage/format/sealed.h"

namespace {

using namespace relmap;
using namespace relmap::storage;
using fuzzing::must;

constexpr std::uint8_t kHeadKind = 6, kBlockKind = 7;

bool is_damage(Reason reason) {
  return fuzzing::is_one_of(reason, {Reason::TRUNCATED, Reason::CORRUPT, Reason::UNKNOWN_FORMAT_VERSION});
}

Bytes encoded(EventBlockHeader header, const std::vector<Event>& events) {
  EventBlock block;
  for (const Event& event : events) block.add(event);
  header.bytes_through = 0;
  return encode_event_block(header, block);
}

// What decodes must encode to bytes that decode to the same again.
void try_block(ByteSpan bytes) {
  std::vector<Event> events;
  const auto header = decode_event_block(bytes, events);
  const auto alone = decode_event_block_header(bytes);
  must(header.ok() ? alone.ok() : is_damage(header.reason()) && events.empty());
  if (!header.ok()) return;
  must(alone->last == header->last && alone->before == header->before && !events.empty());
  must(events.back().at == header->last && events.front().at > header->before);
  for (std::size_t i = 1; i < events.size(); ++i) must(events[i - 1].at < events[i].at);
  const Bytes once = encoded(*header, events);
  std::vector<Event> again;
  must(decode_event_block(once, again).ok() && again.size() == events.size());
  must(encoded(*header, again) == once);
}

void try_head(ByteSpan bytes) {
  const auto head = decode_event_head(bytes);
  must(head.ok() || is_damage(head.reason()));
  if (head.ok()) must(decode_event_head(encode_event_head(*head)).or_throw() == *head);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const ByteSpan bytes(data, size);
  try_block(bytes);
  try_head(bytes);
  try_block(seal(kBlockKind, 1, bytes));
  try_head(seal(kHeadKind, 1, bytes));
  Bytes mended(bytes.begin(), bytes.end());
  constexpr std::size_t kHeaderBytes = 8, kCrcBytes = 4;
  if (mended.size() < kHeaderBytes + kCrcBytes) return 0;
  const auto body = static_cast<std::uint32_t>(mended.size() - kHeaderBytes - kCrcBytes);
  std::memcpy(mended.data() + 4, &body, sizeof body);
  const std::uint32_t crc = crc32c(ByteSpan(mended).first(mended.size() - kCrcBytes));
  std::memcpy(mended.data() + mended.size() - kCrcBytes, &crc, sizeof crc);
  try_block(mended);
  try_head(mended);
  return 0;
}
