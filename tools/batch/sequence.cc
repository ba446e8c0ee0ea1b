#include "tools/batch/sequence.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include "proto/names.h"

namespace relmap::batch {

namespace {

namespace fs = std::filesystem;

// FNV-1a, and the finaliser of splitmix64 over it.
std::uint64_t hash(std::string_view text, std::uint64_t seed) {
  std::uint64_t h = 0xcbf29ce484222325 ^ seed;
  for (const char c : text) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9;
  h = (h ^ (h >> 27)) * 0x94d049bb133111eb;
  return h ^ (h >> 31);
}

// "sequences/06"; what is too long for a name loses its beginning.
std::string name_of(const fs::path& path) {
  const std::string name = path.parent_path().filename().string() + "/" + path.filename().string();
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

SessionUuid uuid_of(const Sequence& sequence, const RecordingOptions& options) {
  const std::string text = (options.robot.empty() ? kUsualRobot : options.robot) + '\n' + options.calibration + '\n' +
                           (options.mono ? "mono" : "stereo") + '\n' + sequence.path;
  SessionUuid uuid;
  const std::uint64_t halves[] = {hash(text, 0), hash(text, 0x9e3779b97f4a7c15)};
  std::memcpy(uuid.bytes.data(), halves, sizeof halves);
  uuid.bytes[6] = static_cast<std::uint8_t>((uuid.bytes[6] & 0x0f) | 0x80);  // version 8: of one's own making
  uuid.bytes[8] = static_cast<std::uint8_t>((uuid.bytes[8] & 0x3f) | 0x80);
  return uuid;
}

Result<std::vector<Sequence>> sequences_of(const std::vector<std::string>& paths, const RecordingOptions& options,
                                           ListLog list_log) {
  std::vector<Sequence> sequences;
  std::set<std::string> given;
  for (const std::string& path : paths) {
    std::error_code error;
    const fs::path real = fs::canonical(path, error);
    if (error) return {Reason::NO_SUCH_FILE, path + ": " + error.message()};
    if (!given.insert(real.string()).second) return {Reason::INVALID_ARGUMENT, path + " is given twice"};
    if (!is_log(real.string(), options)) {
      Sequence& sequence = sequences.emplace_back();
      sequence.path = real.string();
      sequence.session = name_of(real);
      sequence.uuid = options.again ? SessionUuid::random() : uuid_of(sequence, options);
      continue;
    }
    auto logged = list_log(real.string());
    if (!logged.ok()) return logged.status();
    for (const LoggedSession& session : *logged)
      sequences.push_back({real.string(), session.name, session.uuid.to_string(), session.first, session.last,
                           options.again ? SessionUuid::random() : session.uuid});
  }
  return sequences;
}

}  // namespace relmap::batch
