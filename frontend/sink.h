// Where keyframes go: over LCM or gRPC to relmapd, or into a file.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "frontend/publishing/publisher.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::frontend {

class KeyframeSink {
 public:
  virtual ~KeyframeSink() = default;
  virtual const SessionHeader& session() const = 0;
  // Where a session that is continued goes on.
  virtual std::optional<Keyframe> last_keyframe() const = 0;
  // As Publisher's; a file is in no map.
  virtual Status await_map(double patience_s) = 0;
  virtual Status push(const Keyframe& keyframe) = 0;
  // As Publisher::hear(); a file has no news.
  virtual void hear(std::function<void(const PoseNews&)> listener) = 0;
  virtual publishing::PublishSummary progress() const = 0;
  // Waits until everything is settled, or nothing more has been for `patience_s` seconds. A file gets its name only if
  // what was pushed is `complete`; else it stays FILE.part.
  virtual Result<publishing::PublishSummary> finish(double patience_s, bool complete) = 0;
  // As Publisher's, whose session has no more keyframes for now; best effort.
  virtual void end_session(double patience_s) = 0;
  virtual Status trouble() const = 0;
  virtual void interrupt() = 0;  // from any thread
};

Result<std::unique_ptr<KeyframeSink>> open_lcm_sink(publishing::PublisherOptions options, const SessionHeader& session);
// `server`: a data folder or HOST:PORT.
Result<std::unique_ptr<KeyframeSink>> open_grpc_sink(const std::string& server, publishing::PublisherOptions options,
                                                     const SessionHeader& session);
Result<std::unique_ptr<KeyframeSink>> open_file_sink(const std::string& path, const SessionHeader& session);

// Where the spool of a session stands unless it is said: below $XDG_STATE_HOME or ~/.local/state.
std::string default_spool(const SessionHeader& session);

}  // namespace relmap::frontend
