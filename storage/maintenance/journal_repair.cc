#include "storage/maintenance/journal_repair.h"

#include <algorithm>
#include <map>
#include <optional>

#include "storage/journal/journal_log.h"
#include "storage/journal/journal_record.h"
#include "storage/journal/journal_segment.h"

namespace relmap::storage {
namespace {

// Where a whole record stands.
struct Place {
  std::string path;
  std::uint64_t offset = 0;
};

struct Contents {
  std::map<std::uint64_t, Place> whole;  // by sequence, those behind `applied`
  std::uint64_t durable = 0;             // the highest sequence known to have been durable
};

// Finds every record that can still be read. Where segments overlap, the later one has what was written last.
Result<Contents> read_all(const FileSystem& files, const std::string& directory, std::uint64_t applied) {
  Contents contents;
  contents.durable = applied;
  const auto names = files.list(directory);
  if (names.reason() == Reason::NO_SUCH_FILE) return contents;
  if (!names.ok()) return names.status();
  for (const std::string& name : *names) {
    const auto parsed = SegmentName::parse(name);
    if (!parsed) continue;
    const std::uint64_t first = parsed->first;
    contents.durable = std::max(contents.durable, first - 1);  // a segment is begun when all before it is durable
    contents.whole.erase(contents.whole.lower_bound(first), contents.whole.end());
    const std::string path = directory + "/" + name;
    const auto reader = SegmentReader::open(files, path);
    if (reader.reason() == Reason::CORRUPT) continue;  // not the segment that its name says: its records do not count
    if (!reader.ok()) return reader.status();
    std::uint64_t previous = first - 1;
    for (std::uint64_t offset = reader->first_offset();;) {
      auto record = reader->record_at(offset);
      if (record.ok() && (!*record || (*record)->sequence <= previous)) record = reader->find_after(offset, previous);
      if (!record.ok()) return record.status();
      if (!*record) break;
      const SegmentRecord& found = **record;
      contents.durable = std::max(contents.durable, found.acknowledged_through);
      if (found.sequence > applied && decode_record(found.payload).ok())
        contents.whole[found.sequence] = {path, found.offset};
      previous = found.sequence;
      offset = found.end;
    }
  }
  // The rest of the last group may have been acknowledged, if it is whole. What is torn behind it was not.
  while (contents.whole.contains(contents.durable + 1)) ++contents.durable;
  contents.whole.erase(contents.whole.upper_bound(contents.durable), contents.whole.end());
  return contents;
}

class JournalRepair {
 public:
  JournalRepair(const std::shared_ptr<FileSystem>& files, const std::string& to, std::uint64_t applied,
                const Contents& contents, const OnFinding& on_finding, const OnProgress& on_progress)
      : files_(files),
        to_(to),
        applied_(applied),
        contents_(contents),
        on_finding_(on_finding),
        on_progress_(on_progress) {}

  Result<JournalCopy> run(const std::vector<Session>& sessions) {
    for (const Session& session : sessions) expected_[session.number] = session.next_sequence;
    auto log = JournalLog::open(files_, to_, applied_);
    if (!log.ok()) return log.status();
    JournalCopy copy;
    copy.sound = false;
    for (std::uint64_t sequence = applied_ + 1; sequence <= contents_.durable; ++sequence) {
      if (on_progress_ && !on_progress_({"journal", sequence - applied_, contents_.durable - applied_, "records"}))
        return Status(Reason::SHUTTING_DOWN, "the repair was stopped; it can be run again");
      Bytes bytes;
      if (const auto place = contents_.whole.find(sequence); place != contents_.whole.end()) {
        auto read = read_at(place->second);
        if (!read.ok()) return read.status();
        bytes = std::move(*read);
        if (const auto decoded = decode_record(bytes); decoded.ok()) note(decoded->record);
        substitutes_.clear();
      } else {
        if (copy.lost.empty() || copy.lost.back().last + 1 != sequence) {
          copy.lost.push_back({sequence, sequence});
          const Status looked = find_substitutes(sequence);
          if (!looked.ok()) return looked;
        }
        copy.lost.back().last = sequence;
        bytes = encode_record(next_substitute(), sequence - 1);
      }
      const auto appended = (*log)->append({&bytes, 1});
      if (!appended.ok()) return appended.status();
    }
    for (const RecordRange& range : copy.lost)
      tell("journal records " + std::to_string(range.first) + ".." + std::to_string(range.last) +
           " were durable and cannot be read");
    copy.last = contents_.durable;
    return copy;
  }

 private:
  void tell(const std::string& what) {
    if (on_finding_) on_finding_({Reason::DATA_LOSS, {}, what, true});
  }
  Result<Bytes> read_at(const Place& place) const {
    const auto reader = SegmentReader::open(*files_, place.path);
    if (!reader.ok()) return reader.status();
    auto record = reader->record_at(place.offset);
    if (!record.ok()) return record.status();
    if (!*record) return Status(Reason::IO_ERROR, place.path + " changed while it was read");
    return std::move((**record).payload);
  }

  // Follows which sequence each session expects next.
  void note(const JournalRecord& record) {
    if (const auto* session = std::get_if<SessionRecord>(&record)) expected_.try_emplace(session->number, 0);
    if (const auto* keyframe = std::get_if<KeyframeRecord>(&record))
      if (const auto decoded = decode_keyframe(keyframe->payload); decoded.ok())
        expect_after(keyframe->session, decoded->sequence);
    if (const auto* gap = std::get_if<GapRecord>(&record)) expect_after(gap->session, gap->to);
    if (const auto* refusal = std::get_if<RefusalRecord>(&record)) expect_after(refusal->session, refusal->sequence);
  }
  void expect_after(SessionNumber session, std::uint32_t sequence) {
    const auto known = expected_.find(session);
    if (known != expected_.end()) known->second = std::max(known->second, std::uint64_t{sequence} + 1);
  }

  // Works out what the records of a hole must have been, from the first record of each session behind the hole.
  Status find_substitutes(std::uint64_t hole) {
    substitutes_.clear();
    std::map<SessionNumber, bool> seen;
    for (auto place = contents_.whole.upper_bound(hole); place != contents_.whole.end(); ++place) {
      const auto bytes = read_at(place->second);
      if (!bytes.ok()) return bytes.status();
      const auto decoded = decode_record(*bytes);
      if (!decoded.ok()) continue;
      const JournalRecord& record = decoded->record;
      if (const auto* begun = std::get_if<SessionRecord>(&record)) seen[begun->number] = true;
      if (const auto* gap = std::get_if<GapRecord>(&record)) bridge(seen, gap->session, gap->from, nullptr);
      if (const auto* refusal = std::get_if<RefusalRecord>(&record))
        bridge(seen, refusal->session, refusal->sequence, nullptr);
      if (const auto* keyframe = std::get_if<KeyframeRecord>(&record))
        if (const auto frame = decode_keyframe(keyframe->payload); frame.ok())
          bridge(seen, keyframe->session, frame->sequence, &frame->session);
    }
    return {};
  }
  void bridge(std::map<SessionNumber, bool>& seen, SessionNumber session, std::uint32_t sequence,
              const SessionHeader* header) {
    if (seen[session]) return;
    if (!expected_.contains(session)) {  // the session began in the hole
      if (!header) return;
      expected_[session] = 0;
      substitutes_.push_back(SessionRecord{session, header->name, *header});
    }
    seen[session] = true;
    const std::uint64_t next = expected_[session];
    if (next >= sequence) return;
    const GapRecord gap{session, static_cast<std::uint32_t>(next), sequence - 1, Reason::DATA_LOSS};
    tell("frames " + FrameId{session, gap.from}.to_string() + ".." + std::to_string(gap.to) +
         " are lost with their journal records; they are recorded as a gap");
    substitutes_.push_back(gap);
  }
  // Each substitute stands for at least one record that was lost, so there is room for all.
  JournalRecord next_substitute() {
    if (substitutes_.empty()) return IdleWorkRecord{0};
    JournalRecord record = std::move(substitutes_.front());
    substitutes_.erase(substitutes_.begin());
    note(record);
    return record;
  }

  const std::shared_ptr<FileSystem>& files_;
  const std::string& to_;
  const std::uint64_t applied_;
  const Contents& contents_;
  const OnFinding& on_finding_;
  const OnProgress& on_progress_;
  std::map<SessionNumber, std::uint64_t> expected_;  // next sequence
  std::vector<JournalRecord> substitutes_;           // for the hole at hand
};

}  // namespace

Result<JournalCopy> repair_journal(const std::shared_ptr<FileSystem>& files, const std::string& from,
                                   const std::string& to, std::uint64_t applied, const std::vector<Session>& sessions,
                                   const OnFinding& on_finding, const OnProgress& on_progress) {
  const auto contents = read_all(*files, from, applied);
  if (!contents.ok()) return contents.status();
  // All records from applied + 1 to the last durable one are whole. At most a tail that was not acknowledged is cut off
  // when the engine opens.
  if (contents->whole.size() == contents->durable - applied) {
    JournalCopy copy;
    copy.last = contents->durable;
    return copy;
  }
  return JournalRepair(files, to, applied, *contents, on_finding, on_progress).run(sessions);
}

}  // namespace relmap::storage
