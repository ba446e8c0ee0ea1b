// Any bytes as a file of a journal, with a salt and without: opening, reading and searching it end, and a repair makes
// a journal of it that opens without loss.
#include <cstdlib>

#include "storage/journal/journal_log.h"
#include "storage/journal/journal_segment.h"
#include "storage/maintenance/journal_repair.h"
#include "storage/testing/forgetful_files.h"

namespace {

// A repair may write as many substitutes as the largest loss that it believes; the fuzzer looks for other things.
constexpr std::uint64_t kFewRecords = 1000;

void must(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using namespace relmap::storage;
  if (size == 0) return 0;
  const auto disk = ForgetfulFiles::create(1);
  SegmentName name{1, {}};
  if (data[0] % 2 == 0) name.salt = 0x5a9c3e017bd24f68;
  must(disk->create_directory("j").ok());
  {
    const auto file = disk->open_append("j/" + name.to_string());
    must(file.ok() && (*file)->append(ByteSpan(data + 1, size - 1)).ok() && (*file)->sync().ok());
  }
  std::uint64_t highest = 0;
  if (const auto reader = SegmentReader::open(*disk, "j/" + name.to_string()); reader.ok()) {
    std::uint64_t previous = 0;
    for (std::uint64_t offset = 0;;) {
      const auto found = reader->find_after(offset, previous);
      must(found.ok());
      if (!*found) break;
      must((*found)->sequence > previous && (*found)->offset >= offset && (*found)->end > (*found)->offset);
      const auto again = reader->record_at((*found)->offset);
      must(again.ok() && *again && (*again)->payload == (*found)->payload);
      previous = (*found)->sequence;
      highest = previous;
      offset = (*found)->end;
    }
  }
  const auto opened = JournalLog::open(disk, "j", 0, {.read_only = true});
  if (!opened.ok()) return 0;  // of another version
  std::uint64_t read = 0;
  (void)(*opened)->read(1, [&](std::uint64_t sequence, ByteSpan) {
    must(sequence == ++read);
    return true;
  });
  must(read == (*opened)->last());
  if (highest > kFewRecords) return 0;
  const auto copy = repair_journal(disk, "j", "mended", 0, {}, {}, {});
  must(copy.ok());
  if (copy->sound) return 0;
  const auto mended = JournalLog::open(disk, "mended", 0, {});
  must(mended.ok() && (*mended)->loss().ok() && (*mended)->last() == copy->last);
  return 0;
}
