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

// How all recordings of a command are taken in.
struct RecordingOptions {
  std::string source = "auto";  // of relmap-frontend: kitti, euroc, images, log, sim, auto
  std::string robot;            // empty: as recorded in logs and files of keyframes, else "batch"
  std::string calibration;
  bool mono = false;
  bool again = false;  // make new sessions, even of recordings that the map has
};

struct Sequence {
  std::string path;            // absolute
  std::string session;         // name of the session
  std::string camera = {};     // photographs: the camera, of those in the folder
  std::uint64_t pictures = 0;  // photographs: the number of pictures of that camera; 0: not known
  std::string recorded;        // logs: uuid of the session in the log; empty: the recording is no log
  std::uint32_t first = 0;     // logs: range of the keyframes of which anything was recorded
  std::uint32_t last = 0;
  SessionUuid uuid;                                   // of the session; the parts of a split log have the same one
  std::string robot = {};                             // files of keyframes: the recorded robot
  std::optional<RecordingIdentity> recording = {};    // present identity; nullopt for logs
  Status unlisted = {};                               // why `recording` is not known
  double supposed_rate_hz = 0;                        // pairs a second, assumed if nothing tells their times; else 0
  bool readable = true;                               // false: there is nothing at the path, or no log that can be read
  std::vector<std::string> folders_passed_over = {};  // in a folder of photographs, by name
  std::vector<std::string> files_passed_over = {};
};

struct LoggedSession {
  SessionUuid uuid;
  std::string name;
  std::uint32_t first = 0, last = 0;
};
struct FolderCamera {
  std::string name;
  std::uint64_t pictures = 0;
  std::optional<RecordingIdentity> recording = {};
  Status unlisted = {};  // why `recording` is not known
};
struct PhotographFolder {
  std::vector<FolderCamera> cameras;
  std::vector<std::string> folders_passed_over = {}, files_passed_over = {};
};
struct ListedRecording {
  RecordingIdentity recording;
  std::string robot, session;  // as recorded in a file of keyframes; empty for others
  double supposed_rate_hz = 0;
};
// Functions that list what is in a recording without reading all of it: the sessions of a log, the cameras of a folder
// of photographs, the identity of any other recording (null: identities stay unknown).
struct RecordingLister {
  Result<std::vector<LoggedSession>> (*log)(const std::string& path) = nullptr;
  Result<PhotographFolder> (*photographs)(const std::string& folder, const RecordingOptions& options) = nullptr;
  Result<ListedRecording> (*recording)(const std::string& path, const RecordingOptions& options) = nullptr;
};

// The sequences of recordings, in the order given. A log gives one for each session in it, with the uuid that it was
// recorded with; a folder of photographs (options.mono) one for each camera; any other recording gives one. A file of
// keyframes has the session name that it records; others are named by the last two components of their path, whatever
// else is given. INVALID_ARGUMENT if a path is given twice.
Result<std::vector<Sequence>> sequences_of(const std::vector<std::string>& paths, const RecordingOptions& options,
                                           const RecordingLister& list);

// FNV-1a with the finaliser of splitmix64. Never changes for the same text, since identities are made of it.
std::uint64_t hash_text(std::string_view text, std::uint64_t seed);

// The uuid of the session: always the same for the same path, camera, robot, calibration, and mono or stereo.
SessionUuid uuid_of(const Sequence& sequence, const RecordingOptions& options);

}  // namespace relmap::batch
