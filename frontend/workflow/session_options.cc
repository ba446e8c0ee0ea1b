#include "frontend/workflow/session_options.h"

#include <chrono>
#include <cmath>

#include "frontend/sink.h"
#include "frontend/tracking/keyframe_pictures.h"
#include "proto/base/names.h"

namespace relmap::workflow {

Result<SessionHeader> session_header(const RunOptions& options, const SessionHeader& recorded) {
  SessionHeader header = recorded;
  if (!options.robot.empty()) header.robot = options.robot;
  if (!options.session.empty()) header.name = options.session;
  if (header.robot.empty()) return {Reason::INVALID_ARGUMENT, "the robot has no name: --robot gives it one"};
  if (Status status = check_name("--robot", header.robot); !status.ok()) return status;
  if (Status status = check_name("--session", header.name); !status.ok()) return status;
  header.oneway |= options.oneway;
  if (!options.as_recorded) header.uuid = options.uuid.empty() ? SessionUuid() : *SessionUuid::parse(options.uuid);
  return header;
}

publishing::PublisherOptions publisher_options(const RunOptions& options, const SessionHeader& session,
                                               const std::string& recording, const std::string& spool_suffix) {
  publishing::PublisherOptions publisher = options.publisher;
  publisher.live = options.live;
  publisher.recording = recording;
  if (options.all_keyframes) publisher.recording += ", all keyframes";
  // The default, whole pictures, is not named.
  if (options.picture == tracking::KeyframePicture::kSmall) publisher.recording += ", small pictures";
  if (options.picture == tracking::KeyframePicture::kNone) publisher.recording += ", no pictures";
  if (options.every > 1) publisher.recording += ", every " + std::to_string(options.every);
  if (publisher.spool.empty()) publisher.spool = frontend::default_spool(session) + spool_suffix;
  if (publisher.in_memory) publisher.patience = std::chrono::milliseconds(std::llround(1e3 * options.patience_s));
  return publisher;
}

}  // namespace relmap::workflow
