#include "frontend/workflow/track_pairs.h"

#include <cstdint>
#include <cstdio>
#include <utility>

#include "frontend/imu_feed.h"
#include "frontend/tracking/pipeline.h"
#include "frontend/tracking/tracker.h"
#include "frontend/workflow/delivery.h"
#include "frontend/workflow/held_back.h"
#include "frontend/workflow/pair_counts.h"
#include "frontend/workflow/pair_outputs.h"
#include "frontend/workflow/pair_reader.h"

namespace relmap::workflow {

namespace {

Status check_tracked(const Run& run) {
  const bool fine = run.stop || run.summary.lost == 0 || run.summary.tracked > 1;
  return fine ? Status() : untracked(run.summary, "none of ");
}

}  // namespace

Status introduce_stereo(const Run& run, const capture::StereoSource& source) {
  if (!run.options.quiet) std::fprintf(stderr, "%s\n", source.describe().c_str());
  if (Status status = tracking::check_stereo(source.camera()); !status.ok())
    return {status.reason(), status.message() + "; --source images --mono makes places of its pictures"};
  return {};
}

Status track_pairs(Run& run, const PairsToTrack& pairs) {
  const RunOptions& options = run.options;
  capture::StereoSource& source = pairs.source;
  auto imu = frontend::ImuFeed::open(options.imu, source, options.quiet);
  if (!imu.ok()) return imu.status();
  SessionHeader header;
  header.name = pairs.name;
  header.camera = source.camera();
  header.raw = source.raw_calibration();
  auto opened = Delivery::open(run, header, source.fingerprint());
  if (!opened.ok()) return opened.status();
  Delivery& delivery = **opened;
  const auto& last = delivery.last_keyframe();
  // Whether the run continues another is known only from the spool.
  auto outputs = PairOutputs::open(options, last.has_value());
  if (!outputs.ok()) return outputs.status();

  tracking::TrackerOptions tracker_options;
  tracker_options.every_pair = options.all_keyframes;
  tracking::StereoTracker tracker(delivery.session(), tracker_options);
  tracking::PipelineOptions pipeline_options;
  pipeline_options.drop_oldest = options.live;
  if (options.live) pipeline_options.waiting = 2;
  pipeline_options.picture = options.picture;
  PairReader reader(run, source);
  if (last) {
    tracker.resume(*last);
    pipeline_options.stamps = reader.go_on_at(last->time_us);
  }
  if (*imu) tracker.use_imu((*imu)->calibration(), source.rectifier().left_rotation());
  reader.show_to(pairs.read);
  PairCounts counts(run.summary);
  HeldBack held_back(delivery, run.summary);
  const bool hold_back = pairs.hold_back && !last;
  delivery.begin_progress(source.count() / options.every);

  tracking::PipelineStages stages;
  stages.before_tracking = [&](tracking::StereoTracker& t, std::int64_t time_us) {
    if (*imu) t.feed((*imu)->until(time_us));
    if (options.live) t.limit_keyframe_rate(delivery.wanted_hz());
  };
  stages.capture = [&] { return reader.next(); };
  stages.refused = [&](const Status& status) { run.refusals.say(status); };
  stages.publish = [&](tracking::TrackedPair& pair) -> Status {
    counts.add(pair);
    if (Status status = outputs->add(pair); !status.ok()) return status;
    if (pair.keyframe)
      if (Status status = hold_back ? held_back.push(std::move(*pair.keyframe)) : delivery.push(*pair.keyframe);
          !status.ok())
        return status;
    delivery.show_progress();
    return {};
  };
  tracking::Pipeline pipeline(tracker, source.rectifier(), std::move(stages), pipeline_options);
  const Status status = pipeline.run();

  counts.add(pipeline.summary());
  counts.expect(source, options.every, status.ok() && !run.stop && !run.summary.gone_on);
  if (pairs.ended) pairs.ended();
  const Status closed = outputs->close();
  if (!status.ok() && !run.was_interrupted(status)) return status;
  const Status tracked = check_tracked(run);
  if (tracked.ok() && !run.stop)
    if (Status released = held_back.release(); !released.ok()) return released;
  if (Status finished = delivery.finish(tracked.ok() && (!run.stop || options.live)); !finished.ok()) return finished;
  return closed.ok() ? tracked : closed;
}

}  // namespace relmap::workflow
