// A run's keyframes on their way out: into a file, or to a daemon, with what the daemon says meanwhile and what people
// are told of it.
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

// Fills in what the run's summary says of the session and its keyframes. From its opening on a thread of its own tells
// the sink when the run is to stop. Functions are called by one thread at a time, wanted_hz() by any.
class Delivery {
 public:
  // `session`: its names hold where the options ask for no others. `recording`: what it is made of, for
  // publisher_options(), and so is `spool_suffix`. A recording that was begun in another map than the daemon's, or in
  // one that has lost what came after a backup, is published to it from its beginning. Reasons: session_header()'s, the
  // sink's.
  static Result<std::unique_ptr<Delivery>> open(Run& run, const SessionHeader& session, const std::string& recording,
                                                const std::string& spool_suffix = {});
  Delivery(const Delivery&) = delete;
  Delivery& operator=(const Delivery&) = delete;

  const SessionHeader& session() const { return sink_->session(); }
  // Where a session that is continued goes on.
  const std::optional<Keyframe>& last_keyframe() const { return last_keyframe_; }
  // What a source that cannot wait is to keep to; 0: as many as there are.
  double wanted_hz() const { return pace_.hz(); }

  Status push(const Keyframe& keyframe);

  // Of `total` of those that the run reads; 0: nobody knows.
  void begin_progress(std::uint64_t total, const char* what = "pairs");
  void show_progress();

  // No more keyframes. `complete`: there is nothing left to read, as far as can be told. Waits until all is settled and
  // the news of it is heard, as long as the options have patience; once. SESSION_DELETED; the sink's reasons.
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
