#include "tools/batch/summary_store.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "proto/base/json.h"

namespace relmap::batch {

namespace {

namespace fs = std::filesystem;

constexpr char kSummary[] = ".json", kOther[] = ".again", kDoubt[] = ".doubt";

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

Summary SummaryStore::read(const SessionUuid& uuid) const {
  if (folder_.empty()) return {};
  // Older versions kept the summaries of all maps in one folder.
  for (const std::string& path : {path_of(uuid, kSummary), folder_ + '/' + uuid.to_string() + kSummary}) {
    const std::string json = text_of(path);
    if (json.empty()) continue;
    auto summary = read_summary(json);
    if (summary.ok()) return std::move(*summary);
    Summary begun;
    begun.recording = read_recording(json);
    return begun;
  }
  return {};
}

Status SummaryStore::begin(const SessionUuid& uuid, const RecordingIdentity& recording) const {
  return write(path_of(uuid, kSummary), Json()
                                            .add("recording", Json()
                                                                  .add("fingerprint", recording.fingerprint)
                                                                  .add("count", recording.count)
                                                                  .add("contents", recording.contents)
                                                                  .add("calibration", recording.calibration))
                                            .text());
}

Status SummaryStore::done(const SessionUuid& uuid, const Summary& summary) const {
  return summary.json.empty() ? Status() : write(path_of(uuid, kSummary), summary.json);
}

Status SummaryStore::taken_in_as(const SessionUuid& own, const SessionUuid& other) const {
  return write(path_of(own, kOther), other.to_string());
}

std::optional<SessionUuid> SummaryStore::other_of(const SessionUuid& own) const {
  return folder_.empty() ? std::nullopt : SessionUuid::parse(text_of(path_of(own, kOther)));
}

Status SummaryStore::doubt(const SessionUuid& uuid, const Doubt& doubt) const {
  return write(path_of(uuid, kDoubt), doubt.boot + '\n' + doubt.text);
}

std::optional<SummaryStore::Doubt> SummaryStore::doubt_of(const SessionUuid& uuid) const {
  const std::string text = folder_.empty() ? std::string() : text_of(path_of(uuid, kDoubt));
  const std::size_t line = text.find('\n');
  if (line == std::string::npos) return std::nullopt;
  return Doubt{text.substr(0, line), text.substr(line + 1)};
}

void SummaryStore::forget_doubt(const SessionUuid& uuid) const {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove(path_of(uuid, kDoubt), ignored);
}

// Replaces the file atomically.
Status SummaryStore::write(const std::string& path, const std::string& text) const {
  if (folder_.empty()) return {};
  std::error_code error;
  fs::create_directories(folder_of_map(), error);
  const std::string draft = path + ".new";
  std::ofstream out(draft, std::ios::trunc);
  out << text;
  out.close();
  if (out) fs::rename(draft, path, error);
  if (!out || error)
    return {Reason::IO_ERROR, "write " + path + ": a later run will not know what the session was made of"};
  return {};
}

}  // namespace relmap::batch
