#include "frontend/workflow/list_recording.h"

#include <cstdio>

#include "frontend/capture/photograph_folder.h"
#include "frontend/capture/recording_identity.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/console.h"
#include "frontend/workflow/input.h"

namespace relmap::workflow {

namespace {

Status list_log(const RunOptions& options, const Logs& logs) {
  const auto sessions = logs.list(options.path);
  if (!sessions.ok()) return sessions.status();
  for (const recording::RecordedSession& session : *sessions)
    std::printf("%s\n", frontend::recorded_session_json(session).c_str());
  return {};
}

Status list_photographs(const RunOptions& options) {
  const auto folder = capture::open_photographs(options.path, {.calibration = options.calibration});
  if (!folder.ok()) return folder.status();
  for (const capture::PhotographFolder::Camera& camera : folder->cameras)
    std::printf("%s\n", frontend::photographs_json(camera, folder->passed_over).c_str());
  return {};
}

Status list_keyframes(const RunOptions& options) {
  const auto file = capture::identity_of_keyframes(keyframe_file(options));
  if (file.ok()) std::printf("%s\n", frontend::keyframe_file_json(*file).c_str());
  return file.status();
}

Status list_pairs(const RunOptions& options, const Outside& outside) {
  const auto source = outside.open_pairs(options);
  if (source.ok())
    std::printf("%s\n",
                frontend::recording_json(capture::identity_of(**source), (*source)->supposed_rate_hz()).c_str());
  return source.status();
}

}  // namespace

Status list_recording(const RunOptions& options, const Outside& outside) {
  switch (input_of(options, outside.logs)) {
    case Input::kCamera:
      return {Reason::INVALID_ARGUMENT, "a live camera is no recording"};
    case Input::kPhotographs:
      return list_photographs(options);
    case Input::kLog:
      return list_log(options, outside.logs);
    case Input::kKeyframes:
      return list_keyframes(options);
    case Input::kPairs:
      break;
  }
  return list_pairs(options, outside);
}

}  // namespace relmap::workflow
