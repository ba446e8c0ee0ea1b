// Any bytes as the files of a robot's spool: it opens or says by name why not; what it holds can be read, and goes on.
// The first byte, modulo their number, chooses the file. The records of segments and the session are written with
// checksums that are right, so that what is behind them is reached; both also come as they are.
#include <filesystem>
#include <string>

#include "frontend/publishing/disk_spool.h"
#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using fuzzing::must;
using fuzzing::write_file;
namespace fs = std::filesystem;

enum File : std::uint8_t { kSegments, kSegmentAsItIs, kSession, kSessionAsItIs, kMap, kRecording, kNames, kFiles };

constexpr char kDrive[] = "kitti /drive --every 1";
constexpr std::uint8_t kNextSegment = 255;  // in place of the length of a record

SessionHeader session() {
  SessionHeader header;
  header.uuid.bytes = {1, 2, 3};
  header.robot = "cart";
  header.name = "morning";
  header.camera = {700, 320, 240, 0.5, 640, 480};
  return header;
}

// Segments of records, each with its length before it in a byte.
void write_segments(const std::string& folder, ByteReader in) {
  static constexpr std::uint8_t kHead[] = {'S', 'L', 'P', 'G', 1, 0};
  for (int number = 0; number == 0 || (in.ok() && in.remaining() > 0); ++number) {
    ByteWriter w;
    w.put_bytes(kHead);
    while (in.ok() && in.remaining() > 0) {
      const auto length = in.get<std::uint8_t>();
      if (length == kNextSegment) break;
      const ByteSpan record = fuzzing::take_up_to(in, length);
      w.put(static_cast<std::uint32_t>(record.size()));
      w.put(crc32c(record));
      w.put_bytes(record);
    }
    const std::string digits = std::to_string(number);
    write_file(folder + "/" + std::string(10 - digits.size(), '0') + digits + ".seg", w.bytes());
  }
}

void write_chosen(const std::string& folder, unsigned file, ByteSpan bytes) {
  switch (file) {
    case kSegments:
      return write_segments(folder, ByteReader(bytes));
    case kSegmentAsItIs:
      return write_file(folder + "/0000000000.seg", bytes);
    case kSession: {
      ByteWriter w;
      w.put_bytes(bytes);
      w.put(crc32c(bytes));
      return write_file(folder + "/session", w.bytes());
    }
    case kSessionAsItIs:
      return write_file(folder + "/session", bytes);
    case kMap:
      return write_file(folder + "/map", bytes);
    case kRecording:
      return write_file(folder + "/recording", bytes);
    default: {  // a file of another name, as of a segment
      std::string name;
      for (const std::uint8_t byte : bytes.first(std::min<std::size_t>(bytes.size(), 10)))
        name += static_cast<char>('0' + byte % 10);
      return write_file(folder + "/" + name + ".seg", {});
    }
  }
}

void read_all(const publishing::DiskSpool& spool) {
  for (const auto& [sequence, entry] : spool.keyframes()) {
    const auto payload = spool.read(sequence);
    must(payload.ok() && payload->size() == entry.bytes && crc32c(*payload) == entry.crc);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const storage::TemporaryFolder kFolder;
  const std::string folder = kFolder / "spool";
  fs::remove_all(folder);
  {
    const auto sound = publishing::DiskSpool::open(folder, session(), kDrive);
    must(sound.ok() && (*sound)->append(0, as_bytes("a keyframe"), crc32c(as_bytes("a keyframe"))).ok());
    must((*sound)->set_map({Uuid{{7}}, 3}).ok());
  }
  write_chosen(folder, data[0] % kFiles, {data + 1, size - 1});
  std::size_t keyframes = 0, gaps = 0;
  MapIdentity map;
  std::uint32_t next = 1;
  {
    const auto spool = publishing::DiskSpool::open(folder, session(), kDrive);
    if (!spool.ok()) {
      must(fuzzing::is_one_of(spool.reason(), {Reason::CORRUPT, Reason::UNKNOWN_FORMAT_VERSION,
                                               Reason::CALIBRATION_CHANGED, Reason::INVALID_ARGUMENT}));
      return 0;
    }
    must((*spool)->damaged_bytes() <= (*spool)->disk_bytes());
    read_all(**spool);
    if (!(*spool)->keyframes().empty()) next = (*spool)->keyframes().rbegin()->first + 1;
    if (next == 0) return 0;  // there are no more sequences
    must((*spool)->append(next, as_bytes("one more"), crc32c(as_bytes("one more"))).ok());
    must((*spool)->append_gap({session().uuid, next + 1, next + 2, Reason::DROPPED_BY_ROBOT}).ok());
    must((*spool)->mark_unrepeatable().ok());
    keyframes = (*spool)->keyframes().size();
    gaps = (*spool)->gaps().size();
    map = (*spool)->map();
  }
  const auto again = publishing::DiskSpool::open(folder, session(), kDrive);
  must(again.ok() && (*again)->keyframes().size() == keyframes && (*again)->gaps().size() == gaps);
  must((*again)->map() == map && (*again)->read(next).ok());
  must((*again)->read(next + 1).reason() == Reason::NO_SUCH_FRAME);
  must((*again)->remove_below(next).ok());
  read_all(**again);
  must((*again)->begin_anew().ok() && (*again)->keyframes().empty());
  return 0;
}
