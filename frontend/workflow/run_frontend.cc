#include "frontend/workflow/run_frontend.h"

#include <chrono>

#include "frontend/workflow/input.h"
#include "frontend/workflow/output_paths.h"
#include "frontend/workflow/workflows.h"

namespace relmap::workflow {

namespace {

Status take_in(Run& run) {
  if (Status status = check_output_paths(run.options); !status.ok()) return status;
  const Input input = input_of(run.options, run.outside.logs);
  if (!run.options.recorded.empty() && input != Input::kLog && input != Input::kPhotographs)
    return {Reason::INVALID_ARGUMENT, run.options.path + " is no log: there is no session to choose"};
  switch (input) {
    case Input::kPhotographs:
      return take_photographs(run);
    case Input::kLog:
      return replay_log(run);
    case Input::kKeyframes:
      return replay_file(run);
    case Input::kCamera:
      return track_camera(run);
    case Input::kPairs:
      break;
  }
  return track_recording(run);
}

}  // namespace

Status run_frontend(const RunOptions& options, const Outside& outside, const std::atomic<bool>& stop,
                    frontend::RunSummary& summary, const Waits& waits) {
  Run run(options, outside, stop, summary, waits);
  Status status = take_in(run);
  summary.left_out = run.refusals.all();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - run.begin).count();
  summary.interrupted = stop;
  summary.failure = status;
  return status;
}

}  // namespace relmap::workflow
