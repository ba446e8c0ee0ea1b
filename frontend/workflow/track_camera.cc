#include <cstdio>
#include <memory>
#include <thread>
#include <utility>

#include "frontend/capture/iidc/iidc_source.h"
#include "frontend/rig_watch.h"
#include "frontend/workflow/rig_findings.h"
#include "frontend/workflow/track_pairs.h"
#include "frontend/workflow/workflows.h"

namespace relmap::workflow {

namespace {

// Whether a camera that could not be opened for this reason may become available.
bool may_come(Reason reason) {
  return reason == Reason::NO_CAMERA || reason == Reason::CAMERA_GONE || reason == Reason::CAMERA_BUSY ||
         reason == Reason::CAMERA_FORBIDDEN;
}

Result<std::unique_ptr<iidc::IidcSource>> open_or_await(const Run& run) {
  const RunOptions& options = run.options;
  const auto open = run.outside.cameras_on(options.bus);
  if (!open.ok()) return open.status();
  const iidc::IidcOptions iidc{options.path, options.camera_folder, options.calibration, options.rate_hz};
  auto opened = (*open)(iidc, run.stop);
  for (Reason told = Reason::OK; options.wait && !run.stop && may_come(opened.reason());
       opened = (*open)(iidc, run.stop)) {
    if (std::exchange(told, opened.reason()) != opened.reason())
      std::fprintf(stderr, "%s; waiting for it\n", opened.status().to_string().c_str());
    for (auto looks = run.waits.camera / run.waits.look; looks > 0 && !run.stop; --looks)
      std::this_thread::sleep_for(run.waits.look);
  }
  return opened;
}

}  // namespace

Status track_camera(Run& run) {
  auto opened = open_or_await(run);
  if (!opened.ok()) return opened.status();
  iidc::IidcSource& camera = **opened;
  if (Status status = introduce_stereo(run, camera); !status.ok()) return status;
  frontend::RigWatch eyes(camera.rectifier(), [&run](const vision::RigReport& rig) {
    run.summary.rig = rig;
    tell_rig_findings(run.summary, run.options.quiet);
  });
  return track_pairs(run, {.source = camera,
                           .name = camera.address().serial,
                           .read = [&](const capture::StereoFrame& pair) { eyes.offer(pair); },
                           .ended =
                               [&] {
                                 eyes.finish();
                                 const iidc::LiveCounts counts = camera.counts();
                                 run.summary.expected = run.summary.pairs + counts.lost;
                                 run.summary.camera = {camera.address().serial, counts.frames,     counts.lost,
                                                       counts.reopened,         counts.begun_anew, counts.drift_ppm};
                               }});
}

}  // namespace relmap::workflow
