// Any bytes as a raw log, with the index of one from where they hold the beginning of an index: as they are, and with
// all checksums corrected. What is given out is what its checksums say, each record once and in order, and of frames
// that can be unpacked; and the index that is written while a log is opened gives the same the next time.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "frontend/capture/raw_log_reader.h"
#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/testing/temporary_folder.h"

namespace {

using namespace relmap;
using namespace relmap::capture;
using fuzzing::must;
using raw_log::kBeginBytes;
using raw_log::kHeadBytes;

void check_index(ByteSpan bytes) {
  std::uint64_t end = kBeginBytes;
  for (const RawLogEntry& entry : parse_raw_log_index(bytes)) {
    must(entry.offset == end && entry.end() > end);
    end = entry.end();
  }
}

template <typename T>
T number_at(const Bytes& bytes, std::size_t at) {
  T number{};
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}
void put_crc(Bytes& bytes, std::size_t at, std::uint32_t crc) { std::memcpy(bytes.data() + at, &crc, sizeof crc); }

// A head has the length of its body at 8, the body's checksum at 12, and its own at its end.
void mend_log(Bytes& log) {
  for (std::size_t at = kBeginBytes; (at = raw_log::find_sync(log, at)) + kHeadBytes <= log.size();) {
    const std::size_t body = at + kHeadBytes, bytes = number_at<std::uint32_t>(log, at + 8);
    const bool whole = bytes <= log.size() - body;
    if (whole) put_crc(log, at + 12, crc32c(ByteSpan(log).subspan(body, bytes)));
    put_crc(log, body - 4, crc32c(ByteSpan(log).subspan(at, kHeadBytes - 4)));
    at = body + (whole ? bytes : 0);
  }
}
// The checksum of an entry goes on from that of the one before.
void mend_index(Bytes& index) {
  constexpr std::size_t kEntry = 32;
  std::uint32_t crc = 0;
  for (std::size_t at = kBeginBytes; at + kEntry + 4 <= index.size(); at += kEntry + 4) {
    crc = crc32c(ByteSpan(index).subspan(at, kEntry), crc);
    put_crc(index, at + kEntry, crc);
  }
}

bool same(const vision::Image& a, const vision::Image& b) { return a.empty() || vision::same_picture(a, b); }

void check_frame(const RawLogReader& log, const RawLogReader::Frame& frame) {
  const StereoLayout& layout = log.header().layout;
  vision::Image left, right, plain_left, plain_right;
  const Status unpacked = unpack(layout, frame.raw, left, right);
  must(unpacked.reason() == capture::detail::unpack_plainly(layout, frame.raw, plain_left, plain_right).reason());
  must(same(left, plain_left) && same(right, plain_right));
  must(!unpacked.ok() || frame.raw.size() >= layout.bytes());
  must(log.time_us(frame.number) == frame.frame.time_us);
}

// Returns the numbers of the frames that are left from here on.
std::vector<std::size_t> read_on(RawLogReader& log) {
  std::vector<std::size_t> frames;
  std::size_t given = 0;
  for (;;) {
    const auto record = log.next();
    must(++given <= log.index().size() + 1);
    if (!record.ok()) {
      must(record.reason() == Reason::CORRUPT);
      continue;
    }
    if (!*record) return frames;
    const auto* frame = std::get_if<RawLogReader::Frame>(&**record);
    if (!frame) continue;
    must(frame->number < log.frames() && (frames.empty() || frame->number > frames.back()));
    frames.push_back(frame->number);
    check_frame(log, *frame);
  }
}

void check_header(const RawLogHeader& header) {
  const Bytes body = raw_log::encode_header(header);
  raw_log::Head head;
  head.kind = raw_log::Kind::kHeader;
  head.bytes = static_cast<std::uint32_t>(body.size());
  head.crc = crc32c(body);
  head.time_us = header.begun_us;
  must(raw_log::decode_head(raw_log::encode_head(head)) == head);
  const auto again = raw_log::decode_header(head, body);
  must(again.ok() && again->layout == header.layout && again->begun_us == header.begun_us);
}

void check_log(const std::string& path, std::size_t size) {
  RawLogIndex index;
  for (int time = 0; time < 2; ++time) {
    auto log = RawLogReader::open(path);
    if (!log.ok()) {
      must(fuzzing::is_one_of(log.reason(), {Reason::CORRUPT, Reason::BAD_SIZE, Reason::UNKNOWN_FORMAT_VERSION,
                                             Reason::IMPLAUSIBLE_CALIBRATION, Reason::NOT_FINITE, Reason::TRUNCATED,
                                             Reason::BAD_ROTATION}));
      return;
    }
    must(is_raw_log(path) && end_of(log->index()) + log->torn_bytes() == size);
    must(time == 0 || log->index() == index);
    index = log->index();
    check_header(log->header());
    const auto frames = read_on(*log);
    log->rewind();
    must(read_on(*log) == frames);
    if (log->frames() == 0) continue;
    const std::size_t middle = log->frames() / 2;
    log->seek(middle);
    const auto rest = read_on(*log);
    must(rest == std::vector(std::lower_bound(frames.begin(), frames.end(), middle), frames.end()));
    log->rewind();
    log->skip_before(log->time_us(middle));
    must(read_on(*log).size() <= frames.size());
    log->seek(log->frames());
    must(read_on(*log).empty());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const storage::TemporaryFolder kFolder;
  const std::string path = kFolder / "log";
  const ByteSpan all(data, size);
  const std::size_t split = std::min(fuzzing::text_of(all).find("RELMAPRI"), size);
  Bytes log(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(split));
  Bytes index(all.begin() + static_cast<std::ptrdiff_t>(split), all.end());
  for (const bool mended : {false, true}) {
    if (mended) {
      mend_log(log);
      mend_index(index);
    }
    check_index(index);
    fuzzing::write_file(path, log);
    if (index.empty())
      std::filesystem::remove(raw_log_index_path(path));
    else
      fuzzing::write_file(raw_log_index_path(path), index);
    check_log(path, log.size());
  }
  return 0;
}
