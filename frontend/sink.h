// Sinks of keyframes: relmapd over LCM or gRPC, or a file.
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
  // The keyframe after which a continued session goes on.
  virtual std::optional<Keyframe> last_keyframe() const = 0;
  // Like Publisher::await_map(); ok for a file.
  virtual Status await_map(double patience_s) = 0;
  virtual Status push(const Keyframe& keyframe) = 0;
  // Like Publisher::hear(); a file has no news.
  virtual void hear(std::function<void(const PoseNews&)> listener) = 0;
  virtual publishing::PublishSummary progress() const = 0;
  // Waits until everything is settled, or nothing has been settled for `patience_s` seconds. A file is renamed from
  // FILE.part to FILE only if it is `complete`.
  virtual Result<publishing::PublishSummary> finish(double patience_s, bool complete) = 0;
  // Like Publisher::end_session(); best effort.
  virtual void end_session(double patience_s) = 0;
  virtual Status trouble() const = 0;
  virtual void interrupt() = 0;  // thread-safe
};

// To the daemon, over the publisher's transport; or why there is no publisher.
Result<std::unique_ptr<KeyframeSink>> sink_of(Result<std::unique_ptr<publishing::Publisher>> publisher);
Result<std::unique_ptr<KeyframeSink>> open_file_sink(const std::string& path, const SessionHeader& session);

// The default folder of a session's spool, below $XDG_STATE_HOME or ~/.local/state.
std::string default_spool(const SessionHeader& session);

}  // namespace relmap::frontend
