#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "frontend/capture/recording_identity.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/report_file.h"
#include "frontend/tracking/mono_keyframes.h"
#include "frontend/workflow/delivery.h"
#include "frontend/workflow/input.h"
#include "frontend/workflow/pair_counts.h"
#include "frontend/workflow/pair_reader.h"
#include "frontend/workflow/workflows.h"

namespace relmap::workflow {

Status take_photographs(Run& run) {
  const RunOptions& options = run.options;
  frontend::RunSummary& summary = run.summary;
  capture::FolderOptions folder;
  folder.calibration = options.calibration;
  folder.camera = options.camera;
  auto opened = capture::open_mono_images(options.path, folder);
  if (!opened.ok()) return opened.status();
  capture::StereoSource& source = **opened;
  if (!options.quiet) std::fprintf(stderr, "%s\n", source.describe().c_str());
  summary.mono = true;
  summary.recording = capture::identity_of(source);
  SessionHeader header;
  header.name = name_of_path(options);
  header.camera = source.camera();
  header.raw = source.raw_calibration();
  auto opened_delivery = Delivery::open(run, header, "mono, " + source.fingerprint());
  if (!opened_delivery.ok()) return opened_delivery.status();
  Delivery& delivery = **opened_delivery;
  const auto& last = delivery.last_keyframe();
  std::optional<frontend::PictureReport> report;
  if (!options.report.empty()) {
    auto file = frontend::PictureReport::open(options.report, last.has_value());
    if (!file.ok()) return file.status();
    report.emplace(std::move(*file));
  }

  tracking::MonoOptions mono;
  if (last) {
    mono.first_sequence = last->sequence + 1;
    mono.resumed_us = last->time_us;
    source.skip_before(last->time_us + 1);
  }
  PairReader reader(run, source);
  delivery.begin_progress(source.count() / options.every, "pictures");
  tracking::MonoStages stages;
  stages.capture = [&] {
    auto picture = reader.next();
    if (picture.ok() && picture->has_value()) ++summary.pairs;
    return picture;
  };
  stages.refused = [&](const Status& status) {
    count_left_out(summary, status.reason());
    run.refusals.say(status);
  };
  stages.publish = [&](tracking::MonoPicture& picture) -> Status {
    summary.tracking_ms += picture.description_ms;
    if (report) report->add(picture);
    if (Status status = delivery.push(picture.keyframe); !status.ok()) return status;
    delivery.show_progress();
    return {};
  };
  const Status status = tracking::run_mono(source.rectifier(), delivery.session(), stages, mono);
  const Status closed = report ? report->close() : Status();
  if (!status.ok() && !run.was_interrupted(status)) return status;
  if (Status finished = delivery.finish(!run.stop); !finished.ok()) return finished;
  if (!closed.ok()) return closed;
  if (run.stop || summary.keyframes > 0 || last) return {};
  return {summary.unreadable.empty() ? Reason::NO_SUCH_FILE : summary.unreadable.begin()->first,
          "none of the " + std::to_string(source.count()) + " pictures became a keyframe"};
}

}  // namespace relmap::workflow
