#include "tools/batch/again.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "proto/base/hex.h"

namespace relmap::batch {

namespace {

namespace fs = std::filesystem;

// The key of a recording among those of the command.
std::string key_of(const Sequence& sequence) {
  return sequence.recorded + '\t' + sequence.camera + '\t' + sequence.path;
}

std::string path_of(const std::string& folder, const std::string& map, const RecordingOptions& options,
                    const std::vector<Sequence>& sequences) {
  std::string command = map + '\n' + options.source + '\n' + options.robot + '\n' + options.calibration + '\n' +
                        (options.mono ? "mono" : "stereo");
  // Only paths are hashed: cameras, or sessions of logs, may have been added since.
  std::string last;
  for (const Sequence& sequence : sequences)
    if (std::exchange(last, sequence.path) != sequence.path) command += "\n\t\t" + sequence.path;
  return folder + "/again-" + hex(std::uint64_t{hash_text(command, 0)});
}

}  // namespace

AgainRecord::AgainRecord(std::string folder, const std::string& map, const RecordingOptions& options,
                         const std::vector<Sequence>& sequences)
    : folder_(std::move(folder)), path_(path_of(folder_, map, options, sequences)) {}

AgainRecord::Identities AgainRecord::read() const {
  Identities identities;
  std::ifstream in(path_);
  for (std::string line; std::getline(in, line);) {
    const std::size_t tab = line.find('\t');
    if (tab == std::string::npos) continue;
    if (const auto uuid = SessionUuid::parse(line.substr(0, tab))) identities[line.substr(tab + 1)] = *uuid;
  }
  return identities;
}

// Replaces the file atomically.
Status AgainRecord::write(const Identities& identities) const {
  std::error_code error;
  fs::create_directories(folder_, error);
  const std::string draft = path_ + ".new";
  std::ofstream out(draft, std::ios::trunc);
  for (const auto& [key, uuid] : identities) out << uuid.to_string() << '\t' << key << '\n';
  out.close();
  if (out) fs::rename(draft, path_, error);
  if (!out || error)
    return {Reason::IO_ERROR, "write " + path_ + ": without this file an interrupted --again cannot resume"};
  return {};
}

Status AgainRecord::take_up(std::vector<Sequence>& sequences,
                            const std::function<bool(const SessionUuid&, const Sequence&)>& outdated) const {
  const Identities before = read();
  Identities now;
  for (Sequence& sequence : sequences) {
    const auto found = before.find(key_of(sequence));
    if (found != before.end() && !outdated(found->second, sequence)) sequence.uuid = found->second;
    now[key_of(sequence)] = sequence.uuid;
  }
  return now == before ? Status() : write(now);  // before anything is sent under these identities
}

Status AgainRecord::forget(const Sequence& sequence) const {
  Identities identities = read();
  return identities.erase(key_of(sequence)) > 0 ? write(identities) : Status();
}

void AgainRecord::done() const {
  std::error_code ignored;
  fs::remove(path_, ignored);
}

}  // namespace relmap::batch
