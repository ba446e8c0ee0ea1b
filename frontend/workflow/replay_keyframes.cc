#include <string>
#include <utility>

#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/recording_identity.h"
#include "frontend/workflow/delivery.h"
#include "frontend/workflow/input.h"
#include "frontend/workflow/workflows.h"

namespace relmap::workflow {

namespace {

struct ReadyMade {
  std::string path;  // where they come from
  NextKeyframe next;
  std::string name;               // the session's, unless the options give one
  std::string spool_suffix = {};  // publisher_options()
};

Status replay(Run& run, const ReadyMade& keyframes) {
  const RunOptions& options = run.options;
  if (!options.report.empty() || !options.show.empty() || options.all_keyframes)
    return {Reason::UNSUPPORTED,
            keyframes.path + " holds keyframes: there are no pairs to report, to show or to choose from"};
  auto keyframe = keyframes.next();
  if (!keyframe.ok()) return keyframe.status();
  if (!keyframe->has_value()) return {Reason::BAD_SIZE, keyframes.path + " holds no keyframe"};
  run.summary.ready_made = true;
  SessionHeader header = (*keyframe)->session;
  header.name = keyframes.name;
  auto opened = Delivery::open(run, header, capture::fingerprint_of_keyframes(header), keyframes.spool_suffix);
  if (!opened.ok()) return opened.status();
  Delivery& delivery = **opened;
  const auto& last = delivery.last_keyframe();
  delivery.begin_progress(0);
  for (; !run.stop && keyframe.ok() && keyframe->has_value(); keyframe = keyframes.next()) {
    ++run.summary.pairs;
    ++run.summary.tracked;
    Keyframe& k = **keyframe;
    if (last && k.sequence <= last->sequence) continue;
    k.session = delivery.session();
    run.pace.wait(run.stop);
    if (Status status = delivery.push(k); run.was_interrupted(status))
      break;
    else if (!status.ok())
      return status;
    delivery.show_progress();
  }
  if (Status status = delivery.finish(keyframe.ok() && !run.stop); !status.ok()) return status;
  return keyframe.status();
}

}  // namespace

Status replay_file(Run& run) {
  const std::string path = keyframe_file(run.options);
  auto file = capture::KeyframeFileReader::open(path);
  if (!file.ok()) return file.status();
  // If the file is damaged, next() returns the reason.
  if (auto identity = capture::identity_of_keyframes(path); identity.ok())
    run.summary.recording = std::move(identity->recording);
  return replay(run, {.path = path, .next = [&] { return file->next(); }, .name = name_of_path(run.options)});
}

Status replay_log(Run& run) {
  auto log = run.outside.logs.open(run.options.path, run.options.recorded);
  if (!log.ok()) return log.status();
  Status status = replay(run, {.path = run.options.path,
                               .next = log->next,
                               .name = log->header.name,
                               .spool_suffix = "." + log->header.uuid.to_string()});
  run.summary.unreadable = log->left_out();
  return status;
}

}  // namespace relmap::workflow
