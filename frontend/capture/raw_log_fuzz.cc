// Any bytes as a raw log, and as the index of one: what is given out is what its checksums say, each record once and in
// order, and of frames that can be unpacked.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "frontend/capture/raw_log_reader.h"

namespace {

void check_index(relmap::ByteSpan bytes) {
  std::uint64_t end = relmap::capture::raw_log::kBeginBytes;
  for (const relmap::capture::RawLogEntry& entry : relmap::capture::parse_raw_log_index(bytes)) {
    if (entry.offset != end || entry.end() <= end) std::abort();
    end = entry.end();
  }
}

void check_log(const std::string& path, std::size_t size) {
  auto log = relmap::capture::RawLogReader::open(path);
  if (!log.ok()) return;
  if (relmap::capture::end_of(log->index()) + log->torn_bytes() != size) std::abort();
  std::size_t given = 0, frames = 0;
  for (;;) {
    const auto record = log->next();
    if (++given > log->index().size() + 1) std::abort();
    if (!record.ok()) continue;
    if (!*record) break;
    const auto* frame = std::get_if<relmap::capture::RawLogReader::Frame>(&**record);
    if (!frame) continue;
    if (frame->number >= log->frames() || frame->number < frames) std::abort();
    frames = frame->number + 1;
    relmap::vision::Image left, right;
    const auto& layout = log->header().layout;
    const bool unpacked = relmap::capture::unpack(layout, frame->raw, left, right).ok();
    if (unpacked && frame->raw.size() < layout.bytes()) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  check_index({data, size});
  static const int file = ::memfd_create("raw_log_fuzz", MFD_CLOEXEC);
  if (file < 0 || ::ftruncate(file, 0) != 0 || ::pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) return 0;
  check_log("/proc/self/fd/" + std::to_string(file), size);
  return 0;
}
