// What the parts of one run share: its options, the outside, the stop flag, and the summary.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>

#include "frontend/console.h"
#include "frontend/pace.h"
#include "frontend/workflow/outside.h"
#include "frontend/workflow/run_options.h"

namespace relmap::workflow {

// Intervals and time limits of a run. Tests use shorter ones.
struct Waits {
  std::chrono::milliseconds look{50};               // interval of polling
  std::chrono::milliseconds camera{1000};           // interval of attempts to open a camera
  std::chrono::milliseconds silence{5000};          // a daemon silent for so long is reported
  std::chrono::milliseconds slowed{15'000};         // a daemon's limit on the rate expires if not repeated
  std::chrono::milliseconds news_silence{500};      // after such a silence no more news is expected
  std::chrono::milliseconds max_news_wait{10'000};  // maximum wait for news at the end
  double map_s = 5;                                 // seconds for a daemon to say which map it serves
  double end_s = 2;                                 // seconds for a daemon to confirm the end of a session
};

inline constexpr std::size_t kMaxNamedLeftOut = 100'000;  // pictures and pairs of a recording that the summary names

struct Run {
  // The arguments must outlive this, except `run_waits`. Pairs are paced from the construction on.
  Run(const RunOptions& run_options, const Outside& run_outside, const std::atomic<bool>& run_stop,
      frontend::RunSummary& run_summary, const Waits& run_waits = {})
      : options(run_options),
        outside(run_outside),
        stop(run_stop),
        summary(run_summary),
        waits(run_waits),
        pace(is_camera() ? 0 : options.rate_hz),
        refusals(is_camera() ? 0 : kMaxNamedLeftOut) {}

  bool is_camera() const { return options.source == "iidc"; }
  // Whether `status` is only the consequence of the run being stopped: the sink takes nothing more, and the next run
  // continues the session.
  bool was_interrupted(const Status& status) const { return stop && status.reason() == Reason::SHUTTING_DOWN; }

  const RunOptions& options;
  const Outside& outside;
  const std::atomic<bool>& stop;
  frontend::RunSummary& summary;
  const Waits waits;
  const std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
  frontend::Pace pace;
  frontend::Refusals refusals;  // what was left out, and why
};

}  // namespace relmap::workflow
