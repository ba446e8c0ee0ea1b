// Any bytes as a file of a journal, with a salt and without: opening, reading and searching it end, a repair makes a
// journal of it that opens without loss, and a journal without loss goes on. The first byte says by its lowest bit that
// there is no salt, and by the next one that the rest says which records there are, in how many segments, and which of
// them are damaged or missing: the checksums of the others are right, so that the repair finds something to go by.
#include <string>
#include <utility>

#include "proto/base/crc32c.h"
#include "proto/base/testing/fuzzing.h"
#include "storage/journal/journal_log.h"
#include "storage/journal/journal_record.h"
#include "storage/journal/journal_segment.h"
#include "storage/maintenance/journal_repair.h"
#include "storage/testing/forgetful_files.h"

namespace {

using namespace relmap;
using namespace relmap::storage;
using fuzzing::must;

enum Mode : std::uint8_t { kUnsalted = 1, kRecords = 2 };

constexpr std::uint64_t kSalt = 0x5a9c3e017bd24f68;
// A repair may write as many substitutes as the largest loss that it believes; the fuzzer looks for other things.
constexpr std::uint64_t kFewRecords = 1000;

SessionHeader header_of(SessionNumber session) {
  SessionHeader header;
  header.uuid.bytes[0] = static_cast<std::uint8_t>(session);
  header.robot = "cart";
  header.name = "morning";
  header.camera = {700, 320, 240, 0.5, 640, 480};
  return header;
}

// A record of what journals are made of, or bytes that are none.
Bytes record_of(ByteReader& in, std::uint64_t acknowledged) {
  const auto kind = in.get<std::uint8_t>();
  const SessionNumber session = 1 + in.get<std::uint8_t>() % 3u;
  const std::uint32_t frame = in.get<std::uint8_t>();
  const std::uint32_t more = kind / 8u;
  switch (kind % 8) {
    case 0:
      return encode_record(SessionRecord{session, "hall", header_of(session)}, acknowledged);
    case 1:
    case 2: {
      Keyframe keyframe;
      keyframe.session = header_of(session);
      keyframe.sequence = frame;
      const Bytes payload = encode_keyframe(keyframe);
      return encode_record(KeyframeRecord{session, crc32c(payload), payload}, acknowledged);
    }
    case 3:
      return encode_record(GapRecord{session, frame, frame + more, Reason::DROPPED_BY_ROBOT}, acknowledged);
    case 4:
      return encode_record(RefusalRecord{session, frame, more, Reason::NOT_FINITE}, acknowledged);
    case 5:
      return encode_record(IdleWorkRecord{frame}, acknowledged);
    case 6: {  // a keyframe that cannot be decoded
      const ByteSpan payload = fuzzing::take_up_to(in, more);
      return encode_record(KeyframeRecord{session, frame, {payload.begin(), payload.end()}}, acknowledged);
    }
    default: {
      const ByteSpan bytes = fuzzing::take_up_to(in, more);
      return {bytes.begin(), bytes.end()};
    }
  }
}

// Version 1, which has no salt, is only read by now.
void put_unsalted_header(ByteWriter& w, std::uint64_t first) {
  w.put_bytes(as_bytes("RMJL"));
  w.put(std::uint16_t{1});
  w.put(std::uint16_t{0});
  w.put(first);
  w.put(std::uint32_t{0});
  w.put(crc32c(w.bytes()));
}
void put_unsalted_record(ByteWriter& w, std::uint64_t sequence, std::uint64_t acknowledged, ByteSpan payload) {
  ByteWriter length, numbers;
  length.put(static_cast<std::uint32_t>(payload.size()));
  numbers.put(sequence);
  numbers.put(acknowledged);
  w.put_bytes(length.bytes());
  w.put(crc32c(payload, crc32c(numbers.bytes(), crc32c(length.bytes()))));
  w.put_bytes(numbers.bytes());
  w.put_bytes(payload);
}

class Journal {
 public:
  explicit Journal(bool salted) : salted_(salted) {}

  // Before each record, a byte says what is wrong with it or before it.
  void add_records(ByteReader in) {
    while (in.remaining() > 0) {
      const auto how = in.get<std::uint8_t>();
      sequence_ += how % 4u == 3 ? 2 + how / 64u : 1;  // records before it are missing
      if (segments_.empty() || (how & 4u) != 0) begin_segment();
      const std::uint64_t acknowledged = sequence_ - 1 - std::min<std::uint64_t>(sequence_ - 1, how / 16u % 4);
      const Bytes payload = record_of(in, acknowledged);
      ByteWriter& w = segments_.back().second;
      if (salted_)
        put_journal_record(w, *segments_.back().first.salt, sequence_, acknowledged, payload);
      else
        put_unsalted_record(w, sequence_, acknowledged, payload);
      const std::size_t last = w.size() - 1;
      if ((how & 8u) != 0) w.patch(last, static_cast<std::uint8_t>(w.bytes()[last] ^ 1u));
    }
    if (segments_.empty()) begin_segment();
  }
  void add_bytes(ByteSpan bytes) {
    segments_.push_back({{1, salted_ ? std::optional(kSalt) : std::nullopt}, {}});
    segments_.back().second.put_bytes(bytes);
  }
  void write(ForgetfulFiles& disk, const std::string& folder) const {
    for (const auto& [name, bytes] : segments_) {
      const auto file = disk.open_append(folder + "/" + name.to_string());
      must(file.ok() && (*file)->append(bytes.bytes()).ok() && (*file)->sync().ok());
    }
  }
  std::string first_segment() const { return segments_.front().first.to_string(); }

 private:
  void begin_segment() {
    const std::uint64_t first = std::max<std::uint64_t>(sequence_, 1);
    const std::uint64_t salt = kSalt + segments_.size();
    ByteWriter w;
    if (salted_)
      w.put_bytes(segment_header(first, salt));
    else
      put_unsalted_header(w, first);
    segments_.push_back({{first, salted_ ? std::optional(salt) : std::nullopt}, std::move(w)});
  }

  const bool salted_;
  std::uint64_t sequence_ = 0;
  std::vector<std::pair<SegmentName, ByteWriter>> segments_;
};

// Returns the highest sequence that the segment has.
std::uint64_t search(const ForgetfulFiles& disk, const std::string& path) {
  const auto reader = SegmentReader::open(disk, path);
  if (!reader.ok()) return 0;
  std::uint64_t previous = 0;
  for (std::uint64_t offset = 0;;) {
    const auto found = reader->find_after(offset, previous);
    must(found.ok());
    if (!*found) return previous;
    must((*found)->sequence > previous && (*found)->offset >= offset && (*found)->end > (*found)->offset);
    const auto again = reader->record_at((*found)->offset);
    must(again.ok() && *again && (*again)->payload == (*found)->payload);
    previous = (*found)->sequence;
    offset = (*found)->end;
  }
}

// A journal without loss takes records, and lets go of them.
void go_on(const std::shared_ptr<ForgetfulFiles>& disk, const std::string& folder, std::uint64_t last) {
  JournalLogOptions options;
  options.segment_bytes = 100;
  const auto log = JournalLog::open(disk, folder, 0, options);
  must(log.ok() && (*log)->loss().ok() && (*log)->last() == last && (*log)->first() == 1);
  const Bytes record = encode_record(IdleWorkRecord{1}, last);
  for (int i = 1; i <= 3; ++i) {
    const auto appended = (*log)->append({&record, 1});
    must(appended.ok() && *appended == last + static_cast<std::uint64_t>(i));
  }
  std::uint64_t read = 0;
  must((*log)
           ->read(last + 1,
                  [&](std::uint64_t sequence, ByteSpan bytes) {
                    must(sequence == last + ++read && std::ranges::equal(bytes, record));
                    return true;
                  })
           .ok());
  must(read == 3);
  const auto bytes = (*log)->bytes();
  must(bytes.ok() && *bytes > 0);
  must((*log)->trim(last + 2).ok() && (*log)->first() == last + 3);
  must((*log)->trim((*log)->last()).ok() && (*log)->leave_applied().ok());
  must((*log)->first() == last + 4 && (*log)->last() == last + 3);
  const auto left = (*log)->bytes();
  must(left.ok() && *left < *bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const ByteSpan rest(data + 1, size - 1);
  Journal journal((data[0] & kUnsalted) == 0);
  if ((data[0] & kRecords) != 0)
    journal.add_records(ByteReader(rest));
  else
    journal.add_bytes(rest);
  const auto disk = ForgetfulFiles::create(1);
  must(disk->create_directory("j").ok());
  journal.write(*disk, "j");

  const std::uint64_t highest = search(*disk, "j/" + journal.first_segment());
  std::uint64_t last = 0;
  {
    const auto opened = JournalLog::open(disk, "j", 0, {.read_only = true});
    if (!opened.ok()) return 0;  // of another version
    std::uint64_t read = 0;
    (void)(*opened)->read(1, [&](std::uint64_t sequence, ByteSpan) {
      must(sequence == ++read);
      return true;
    });
    last = (*opened)->last();
    must(read == last && !(*opened)->append({}).ok() && !(*opened)->trim(1).ok());
  }
  if (highest > kFewRecords) return 0;
  const auto copy = repair_journal(
      disk, "j", "mended", 0, {}, [](const Finding& f) { must(!f.what.empty()); },
      [](const MaintenanceProgress&) { return true; });
  must(copy.ok());
  if (copy->sound)
    go_on(disk, "j", last);
  else
    go_on(disk, "mended", copy->last);
  return 0;
}
