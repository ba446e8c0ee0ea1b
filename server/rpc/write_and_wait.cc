#include "server/rpc/write_and_wait.h"

namespace relmap::rpc {

namespace {
constexpr std::size_t kMaxNoteBytes = 1024;
}  // namespace

Status write_and_wait(map::Mapper& mapper, EditLog& edits, const std::string& key, const std::string& content,
                      const Deadline& deadline, const std::function<Result<storage::JournalRecord>()>& make_record,
                      std::uint64_t& sequence) {
  const auto written = edits.once(key, content, deadline, [&]() -> Result<std::uint64_t> {
    auto record = make_record();
    if (!record.ok()) return record.status();
    return mapper.submit_and_wait(std::move(record).value());
  });
  if (!written.ok()) return written.status();
  sequence = *written;
  return mapper.wait_applied(sequence, deadline.at);
}

Status check_note(const std::string& note) {
  if (note.size() <= kMaxNoteBytes) return {};
  return {Reason::INVALID_ARGUMENT,
          "a note of " + std::to_string(note.size()) + " bytes; at most " + std::to_string(kMaxNoteBytes)};
}

}  // namespace relmap::rpc
