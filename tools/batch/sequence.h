// One recording that is to become one session of the map.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "tools/batch/recording_identity.h"

namespace relmap::batch {

// How recordings are taken in, all alike.
struct RecordingOptions {
  std::string source = "auto";  // of relmap-frontend: kitti, euroc, images, log, sim, auto
  std::string robot;            // empty: as recorded in logs and files of keyframes, else "batch"
  std::string calibration;
  bool mono = false;
  bool again = false;  // as new sessions each time, though the map may have them
};

struct Sequence {
  std::string path;            // absolute
  std::string session;         // its name
  std::string camera = {};     // of photographs: which camera's of the folder
  std::uint64_t pictures = 0;  // of photographs: how many the folder has of that camera; 0: not known
  std::string recorded;        // uuid of the session within a log; empty: the recording is no log
  std::uint32_t first = 0;     // of a log: the keyframes of which anything was recorded
  std::uint32_t last = 0;
  SessionUuid uuid;                                   // of the session; logs that were split have parts of one
  std::string robot = {};                             // as a file of keyframes records it; empty: nothing does
  std::optional<RecordingIdentity> recording = {};    // as it is now; nothing: of a log
  Status unlisted = {};                               // why that is not known
  double supposed_rate_hz = 0;                        // pairs a second, where nothing tells their times; 0: it is told
  bool readable = true;                               // false: there is nothing at the path, or no log that can be read
  std::vector<std::string> folders_passed_over = {};  // beside photographs, by name
  std::vector<std::string> files_passed_over = {};
};

// One for each recording, in the order given; a log gives one for each session in it, under the uuid that it was
// recorded with, and a folder of photographs (options.mono) one for each camera. A file of keyframes is named as it
// records; any other by the last two components of its path, whatever else is given. INVALID_ARGUMENT: one is given
// twice.
struct LoggedSession {
  SessionUuid uuid;
  std::string name;
  std::uint32_t first = 0, last = 0;
};
struct FolderCamera {
  std::string name;
  std::uint64_t pictures = 0;
  std::optional<RecordingIdentity> recording = {};
  Status unlisted = {};  // why that is not known
};
struct PhotographFolder {
  std::vector<FolderCamera> cameras;
  std::vector<std::string> folders_passed_over = {}, files_passed_over = {};
};
struct ListedRecording {
  RecordingIdentity recording;
  std::string robot, session;  // as a file of keyframes records them; empty: it is none
  double supposed_rate_hz = 0;
};
// What is in a recording, as relmap-frontend lists it without reading it: the sessions of a log, the cameras of a
// folder of photographs, what any other is (null: nobody is asked, and it is not known).
struct RecordingLister {
  Result<std::vector<LoggedSession>> (*log)(const std::string& path) = nullptr;
  Result<PhotographFolder> (*photographs)(const std::string& folder, const RecordingOptions& options) = nullptr;
  Result<ListedRecording> (*recording)(const std::string& path, const RecordingOptions& options) = nullptr;
};
Result<std::vector<Sequence>> sequences_of(const std::vector<std::string>& paths, const RecordingOptions& options,
                                           const RecordingLister& list);

// FNV-1a, and the finaliser of splitmix64 over it. Always the same for the same text: identities are made of it.
std::uint64_t hash_text(std::string_view text, std::uint64_t seed);

// Always the same for the same path, camera, robot, calibration and kind of camera.
SessionUuid uuid_of(const Sequence& sequence, const RecordingOptions& options);

}  // namespace relmap::batch
