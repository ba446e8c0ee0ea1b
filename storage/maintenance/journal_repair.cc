#include "storage/maintenance/journal_repair.h"

#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <utility>

#include "storage/journal/journal_log.h"
#include "storage/journal/journal_record.h"
#include "storage/journal/journal_segment.h"

namespace relmap::storage {
namespace {

// A journal is trimmed once a second, so a name or a record is wrong that claims that more records than these were
// durable and are lost. Without a limit, one such number would have the repair write substitutes for ever.
constexpr std::uint64_t kMostLost = 1u << 24;
constexpr std::size_t kGroup = 1024;  // records that are written at a time

// Where a whole record stands.
struct Place {
  std::string path;
  std::uint64_t offset = 0;
};

struct Contents {
  std::map<std::uint64_t, Place> whole;  // by sequence, those behind `applied`
  std::uint64_t durable = 0;             // the highest sequence known to have been durable
  bool left_out = false;                 // a segment that cannot belong to the journal
};

// Finds every record that can still be read. Where segments overlap, the later one has what was written last.
Result<Contents> read_all(const FileSystem& files, const std::string& directory, std::uint64_t applied,
                          const OnFinding& on_finding) {
  Contents contents;
  contents.durable = applied;
  const auto names = files.list(directory);
  if (names.reason() == Reason::NO_SUCH_FILE) return contents;
  if (!names.ok()) return names.status();
  const auto last_known = [&] {
    return std::max(contents.durable, contents.whole.empty() ? applied : contents.whole.rbegin()->first);
  };
  for (const std::string& name : *names) {
    const auto parsed = SegmentName::parse(name);
    if (!parsed) continue;
    const std::uint64_t first = parsed->first;
    const std::string path = directory + "/" + name;
    if (first > last_known() && first - last_known() > kMostLost) {
      contents.left_out = true;
      if (on_finding)
        on_finding(
            {Reason::DATA_LOSS,
             {},
             path + " claims to begin at record " + std::to_string(first) + ", far behind all others, and is left out",
             true});
      continue;
    }
    contents.durable = std::max(contents.durable, first - 1);  // a segment is begun when all before it is durable
    contents.whole.erase(contents.whole.lower_bound(first), contents.whole.end());
    const auto reader = SegmentReader::open(files, path);
    if (reader.reason() == Reason::CORRUPT) continue;  // not the segment that its name says: its records do not count
    if (!reader.ok()) return reader.status();
    std::uint64_t previous = first - 1;
    for (std::uint64_t offset = reader->first_offset();;) {
      auto record = reader->record_at(offset);
      if (record.ok() && (!*record || (*record)->sequence <= previous || (*record)->sequence - previous > kMostLost))
        record = reader->find_after(offset, previous);
      if (!record.ok()) return record.status();
      if (!*record) break;
      const SegmentRecord& found = **record;
      offset = found.end;
      if (found.sequence - previous > kMostLost) continue;
      contents.durable = std::max(contents.durable, found.acknowledged_through);
      if (found.sequence > applied && decode_record(found.payload).ok())
        contents.whole[found.sequence] = {path, found.offset};
      previous = found.sequence;
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
    if (Status indexed = index(); !indexed.ok()) return indexed;
    std::vector<Bytes> group;
    for (std::uint64_t sequence = applied_ + 1; sequence <= contents_.durable; ++sequence) {
      if (on_progress_ && !on_progress_({"journal", sequence - applied_, contents_.durable - applied_, "records"}))
        return Status(Reason::SHUTTING_DOWN, "the repair was stopped; it can be run again");
      if (const auto place = contents_.whole.find(sequence); place != contents_.whole.end()) {
        auto read = read_at(place->second);
        if (!read.ok()) return read.status();
        if (const auto decoded = decode_record(*read); decoded.ok()) note(decoded->record);
        group.push_back(std::move(*read));
        substitutes_.clear();
      } else {
        if (copy.lost.empty() || copy.lost.back().last + 1 != sequence) {
          copy.lost.push_back({sequence, sequence});
          const Status looked = find_substitutes(sequence);
          if (!looked.ok()) return looked;
        }
        copy.lost.back().last = sequence;
        group.push_back(encode_record(next_substitute(), sequence - 1));
      }
      if (group.size() < kGroup && sequence < contents_.durable) continue;
      const auto appended = (*log)->append(group);
      if (!appended.ok()) return appended.status();
      group.clear();
    }
    for (const RecordRange& range : copy.lost)
      tell("journal records " + std::to_string(range.first) + ".." + std::to_string(range.last) +
           " were durable and cannot be read");
    copy.last = contents_.durable;
    return copy;
  }

 private:
  // Where frames of a session begin: in this record, with this frame.
  struct Begins {
    enum Kind : std::uint8_t { kSession, kKeyframe, kSkipped };
    std::uint64_t sequence = 0;
    std::uint32_t frame = 0;
    Kind kind = kSession;
  };

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

  // Notes where the frames of each session begin again, so that a hole is filled without reading all that is behind it.
  Status index() {
    for (const auto& [sequence, place] : contents_.whole) {
      const auto bytes = read_at(place);
      if (!bytes.ok()) return bytes.status();
      const auto decoded = decode_record(*bytes);
      if (!decoded.ok()) continue;
      const JournalRecord& record = decoded->record;
      if (const auto* begun = std::get_if<SessionRecord>(&record))
        sessions_[begun->number].push_back({sequence, 0, Begins::kSession});
      if (const auto* gap = std::get_if<GapRecord>(&record))
        sessions_[gap->session].push_back({sequence, gap->from, Begins::kSkipped});
      if (const auto* refusal = std::get_if<RefusalRecord>(&record))
        sessions_[refusal->session].push_back({sequence, refusal->sequence, Begins::kSkipped});
      if (const auto* keyframe = std::get_if<KeyframeRecord>(&record))
        if (const auto frame = decode_keyframe(keyframe->payload); frame.ok())
          sessions_[keyframe->session].push_back({sequence, frame->sequence, Begins::kKeyframe});
    }
    return {};
  }

  // Works out what the records of a hole must have been, from the first record of each session behind the hole.
  Status find_substitutes(std::uint64_t hole) {
    substitutes_.clear();
    // In the order of the records behind the hole: a hole has room for those that come before the next hole.
    std::map<std::uint64_t, std::pair<SessionNumber, const Begins*>> behind;
    for (const auto& [session, begins] : sessions_) {
      auto next = std::upper_bound(begins.begin(), begins.end(), hole,
                                   [](std::uint64_t sequence, const Begins& one) { return sequence < one.sequence; });
      // A session that began in the hole is known again by its first keyframe.
      if (next != begins.end() && !expected_.contains(session) && next->kind == Begins::kSkipped)
        next = std::find_if(next, begins.end(), [](const Begins& one) { return one.kind != Begins::kSkipped; });
      if (next != begins.end() && next->kind != Begins::kSession) behind[next->sequence] = {session, &*next};
    }
    for (const auto& [sequence, next] : behind)
      if (Status bridged = bridge(next.first, *next.second); !bridged.ok()) return bridged;
    return {};
  }
  Status bridge(SessionNumber session, const Begins& begins) {
    if (!expected_.contains(session)) {
      const auto bytes = read_at(contents_.whole.at(begins.sequence));
      if (!bytes.ok()) return bytes.status();
      const auto decoded = decode_record(*bytes);
      if (!decoded.ok()) return decoded.status();
      const auto keyframe = decode_keyframe(std::get<KeyframeRecord>(decoded->record).payload);
      if (!keyframe.ok()) return keyframe.status();
      expected_[session] = 0;
      substitutes_.push_back(SessionRecord{session, keyframe->session.name, keyframe->session});
    }
    const std::uint64_t next = expected_[session];
    if (next >= begins.frame) return {};
    const GapRecord gap{session, static_cast<std::uint32_t>(next), begins.frame - 1, Reason::DATA_LOSS};
    tell("frames " + FrameId{session, gap.from}.to_string() + ".." + std::to_string(gap.to) +
         " are lost with their journal records; they are recorded as a gap");
    substitutes_.push_back(gap);
    return {};
  }
  // Each substitute stands for at least one record that was lost, so there is room for all.
  JournalRecord next_substitute() {
    if (substitutes_.empty()) return IdleWorkRecord{0};
    JournalRecord record = std::move(substitutes_.front());
    substitutes_.pop_front();
    note(record);
    return record;
  }

  const std::shared_ptr<FileSystem>& files_;
  const std::string& to_;
  const std::uint64_t applied_;
  const Contents& contents_;
  const OnFinding& on_finding_;
  const OnProgress& on_progress_;
  std::map<SessionNumber, std::uint64_t> expected_;        // next sequence
  std::map<SessionNumber, std::vector<Begins>> sessions_;  // of the whole records, in their order
  std::deque<JournalRecord> substitutes_;                  // for the hole at hand
};

}  // namespace

Result<JournalCopy> repair_journal(const std::shared_ptr<FileSystem>& files, const std::string& from,
                                   const std::string& to, std::uint64_t applied, const std::vector<Session>& sessions,
                                   const OnFinding& on_finding, const OnProgress& on_progress) {
  const auto contents = read_all(*files, from, applied, on_finding);
  if (!contents.ok()) return contents.status();
  // If all records from applied + 1 to the last durable one are whole, at most a tail that was not acknowledged is cut
  // off when the engine opens.
  if (contents->whole.size() == contents->durable - applied && !contents->left_out) {
    const auto log = JournalLog::open(files, from, applied, {.read_only = true});
    if (!log.ok()) return log.status();
    if ((*log)->loss().ok()) {
      JournalCopy copy;
      copy.last = contents->durable;
      return copy;
    }
    // It has records of which nothing is known, for example in a segment that is not the one that its name says.
    if (on_finding) on_finding({Reason::DATA_LOSS, {}, (*log)->loss().message(), true});
  }
  return JournalRepair(files, to, applied, *contents, on_finding, on_progress).run(sessions);
}

}  // namespace relmap::storage
