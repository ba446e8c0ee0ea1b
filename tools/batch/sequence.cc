#include "tools/batch/sequence.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include "proto/base/names.h"

namespace relmap::batch {

namespace {

namespace fs = std::filesystem;

// The name of a session: "sequences/06", "photos/tower 640x480". A name that is too long loses its beginning.
std::string name_of(const fs::path& path, const std::string& camera = {}) {
  const std::string name =
      path.parent_path().filename().string() + "/" + path.filename().string() + (camera.empty() ? "" : ' ' + camera);
  if (name.size() <= kMaxNameBytes) return name;
  std::size_t begin = name.size() - kMaxNameBytes;
  while (begin < name.size() && (static_cast<unsigned char>(name[begin]) & 0xc0) == 0x80) ++begin;  // amid a character
  return name.substr(begin);
}

// Each event of an LCM log begins with this word.
bool is_log(const std::string& path, const RecordingOptions& options) {
  if (options.source == "log") return true;
  if (options.source != "auto" || !fs::is_regular_file(path)) return false;
  char word[4] = {};
  std::ifstream(path, std::ios::binary).read(word, sizeof word);
  return std::memcmp(word, "\xed\xa1\xda\x01", sizeof word) == 0;
}

}  // namespace

std::uint64_t hash_text(std::string_view text, std::uint64_t seed) {
  std::uint64_t h = 0xcbf29ce484222325 ^ seed;
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9;
  h = (h ^ (h >> 27)) * 0x94d049bb133111eb;
  return h ^ (h >> 31);
}

SessionUuid uuid_of(const Sequence& sequence, const RecordingOptions& options) {
  const std::string text = (options.robot.empty() ? kUsualRobot : options.robot) + '\n' + options.calibration + '\n' +
                           (options.mono ? "mono" : "stereo") + '\n' + sequence.path +
                           (sequence.camera.empty() ? "" : '\n' + sequence.camera);
  SessionUuid uuid;
  const std::uint64_t halves[] = {hash_text(text, 0), hash_text(text, 0x9e3779b97f4a7c15)};
  std::memcpy(uuid.bytes.data(), halves, sizeof halves);
  uuid.bytes[6] = static_cast<std::uint8_t>((uuid.bytes[6] & 0x0f) | 0x80);  // version 8: custom
  uuid.bytes[8] = static_cast<std::uint8_t>((uuid.bytes[8] & 0x3f) | 0x80);
  return uuid;
}

Result<std::vector<Sequence>> sequences_of(const std::vector<std::string>& paths, const RecordingOptions& options,
                                           const RecordingLister& list) {
  std::vector<Sequence> sequences;
  std::set<std::string> given;
  for (const std::string& path : paths) {
    std::error_code error, ignored;
    fs::path real = fs::canonical(path, error);
    if (error) real = fs::weakly_canonical(path, ignored);
    if (!given.insert(real.string()).second) return {Reason::INVALID_ARGUMENT, path + " is given twice"};
    const auto add = [&](const FolderCamera& camera, const std::string& session) -> Sequence& {
      Sequence& sequence = sequences.emplace_back();
      sequence.path = real.string();
      sequence.session = session;
      sequence.camera = camera.name;
      sequence.pictures = camera.pictures;
      sequence.recording = camera.recording;
      sequence.unlisted = camera.unlisted;
      sequence.uuid = options.again ? SessionUuid::random() : uuid_of(sequence, options);
      return sequence;
    };
    const auto add_unreadable = [&](Status why) {
      Sequence& sequence = add({}, name_of(real));
      sequence.readable = false;
      sequence.unlisted = std::move(why);
    };
    if (error) {
      add_unreadable({Reason::NO_SUCH_FILE, path + ": " + error.message()});
      continue;
    }
    if (options.mono) {
      const auto folder = list.photographs(real.string(), options);
      if (!folder.ok()) {  // the front-end will report what is wrong with the folder
        add({}, name_of(real)).unlisted = folder.status();
        continue;
      }
      for (const FolderCamera& camera : folder->cameras) {
        Sequence& sequence = add(camera, name_of(real, folder->cameras.size() > 1 ? camera.name : ""));
        sequence.folders_passed_over = folder->folders_passed_over;
        sequence.files_passed_over = folder->files_passed_over;
      }
      continue;
    }
    if (!is_log(real.string(), options)) {
      Sequence& sequence = add({}, name_of(real));
      if (!list.recording) continue;
      const auto listed = list.recording(real.string(), options);
      if (!listed.ok()) {
        sequence.unlisted = listed.status();
        continue;
      }
      sequence.recording = listed->recording;
      sequence.supposed_rate_hz = listed->supposed_rate_hz;
      if (!fs::is_regular_file(real) || listed->session.empty()) continue;
      sequence.session = listed->session;
      sequence.robot = listed->robot;
      continue;
    }
    auto logged = list.log(real.string());
    if (!logged.ok()) {
      add_unreadable(logged.status());
      continue;
    }
    for (const LoggedSession& session : *logged)
      sequences.push_back({.path = real.string(),
                           .session = session.name,
                           .recorded = session.uuid.to_string(),
                           .first = session.first,
                           .last = session.last,
                           .uuid = options.again ? SessionUuid::random() : session.uuid});
  }
  return sequences;
}

}  // namespace relmap::batch
