// Delivers a run's keyframes to a file or to a daemon, takes in the daemon's news, and tells the user what matters of
// it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "frontend/console.h"
#include "frontend/publishing/localisation.h"
#include "frontend/publishing/publisher.h"
#include "frontend/sink.h"
#include "frontend/workflow/run.h"
#include "frontend/workflow/wanted_pace.h"
#include "proto/base/status.h"
#include "proto/geometry/geometry.h"
#include "proto/keyframe/ingest_messages.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::workflow {

// Fills in the parts of the run's summary that describe the session and its keyframes. A thread of its own interrupts
// the sink when the run is to stop. Its functions must be called by one thread at a time, except wanted_hz(), which is
// thread-safe.
class Delivery {
 public:
  // Opens the sink. `session` has the names that are used unless the options give others. `recording` and
  // `spool_suffix` are those of publisher_options(). A repeatable source whose session was begun in another map than
  // the daemon's, or whose map was restored from a backup, is published again from its beginning. The reasons of
  // session_header() and of the sink.
  static Result<std::unique_ptr<Delivery>> open(Run& run, const SessionHeader& session, const std::string& recording,
                                                const std::string& spool_suffix = {});
  Delivery(const Delivery&) = delete;
  Delivery& operator=(const Delivery&) = delete;

  const SessionHeader& session() const { return sink_->session(); }
  // The keyframe after which a continued session goes on; nullopt for a new session.
  const std::optional<Keyframe>& last_keyframe() const { return last_keyframe_; }
  // The keyframe rate that the daemon asks a live source not to exceed, in Hz; 0 if there is no limit.
  double wanted_hz() const { return pace_.hz(); }

  Status push(const Keyframe& keyframe);

  // `total` is the number of pairs or pictures (`what`) that the run reads; 0 if it is not known.
  void begin_progress(std::uint64_t total, const char* what = "pairs");
  void show_progress();

  // Ends the delivery. Must be called at most once. `complete` says that the source was read to its end, as far as that
  // is known. Waits until all keyframes are settled, or until options.patience_s has passed without progress, and then
  // for the daemon's news of them. SESSION_DELETED, and the sink's reasons.
  Status finish(bool complete);

 private:
  explicit Delivery(Run& run);

  Status open_sink_in_its_map(publishing::PublisherOptions options, const SessionHeader& header);
  Status await_map();
  void begin();
  void hear(const PoseNews& news);
  void watch(const std::stop_token& done);
  bool sends() const { return run_.options.to != "file"; }
  const std::string& daemon() const;
  Result<publishing::PublishSummary> settle(bool complete);
  void await_news() const;
  void tell_what_is_missing() const;

  Run& run_;
  publishing::Localisation localisation_;
  WantedPace pace_;
  std::unique_ptr<frontend::KeyframeSink> sink_;
  std::jthread watcher_;
  std::optional<frontend::ProgressLine> progress_;
  std::optional<Keyframe> last_keyframe_;
  std::optional<Vector3> last_position_;
};

}  // namespace relmap::workflow
