#include "tests/support/stored_map.h"

#include <filesystem>
#include <set>

#include "frontend/capture/keyframe_file.h"
#include "proto/base/crc32c.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tests/support/running_daemon.h"

namespace relmap::testing {

std::unique_ptr<storage::Map> open_stored_map(const std::string& folder) {
  auto engine = storage::open_rocksdb(folder).or_throw();
  const std::uint64_t epoch = engine->acquire().or_throw();
  return storage::Map::open(std::move(engine), epoch, std::make_shared<storage::Budget>(std::size_t{1} << 30))
      .or_throw();
}

std::unique_ptr<storage::Map> make_stored_map(const std::string& folder) {
  if (!std::filesystem::exists(folder + "/FORMAT")) RunningDaemon({.data = folder, .lcm = "", .more = {}}).stop();
  return open_stored_map(folder);
}

std::vector<Keyframe> read_keyframes(const std::string& file) {
  auto reader = capture::KeyframeFileReader::open(file).or_throw();
  std::vector<Keyframe> keyframes;
  while (auto keyframe = reader.next().or_throw()) keyframes.push_back(std::move(*keyframe));
  return keyframes;
}

std::vector<std::string> settled_once_differences(const storage::Graph& graph, const std::vector<Keyframe>& keyframes) {
  std::vector<std::string> wrong;
  std::vector<storage::Session> sessions = graph.sessions();
  std::erase_if(sessions, storage::is_deleted);
  if (sessions.size() != 1) return {std::to_string(sessions.size()) + " sessions"};
  const storage::Session& session = sessions.front();
  if (session.frames != keyframes.size()) wrong.push_back(std::to_string(session.frames) + " frames counted");
  graph.visit_skipped(session.number, 0, [&](const storage::Skipped& skipped) {
    wrong.push_back(std::to_string(skipped.from) + ".." + std::to_string(skipped.to) + " skipped");
    return true;
  });
  std::set<std::uint64_t> records;
  for (Keyframe keyframe : keyframes) {
    const std::string name = "frame " + std::to_string(keyframe.sequence);
    const auto hot = graph.hot({session.number, keyframe.sequence});
    if (!hot) {
      wrong.push_back(name + " is missing");
      continue;
    }
    keyframe.session = session.header;
    if (hot->payload_crc != crc32c(encode_keyframe(keyframe))) wrong.push_back(name + " has another payload");
    if (graph.warm({session.number, keyframe.sequence})->observations.size() < keyframe.tracks.size())
      wrong.push_back(name + " has lost observations");
    if (graph.cold({session.number, keyframe.sequence})->appearance.size() != keyframe.appearance.size())
      wrong.push_back(name + " has lost appearance");
    if (!records.insert(hot->journal_sequence).second) wrong.push_back(name + " shares its journal record");
  }
  if (!keyframes.empty() && session.last != keyframes.back().sequence)
    wrong.push_back("the last frame is " + std::to_string(session.last));
  return wrong;
}

}  // namespace relmap::testing
