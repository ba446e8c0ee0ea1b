// What the parts of one run share: what it is asked for, what it reaches, when it is to stop, and what it has to tell.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>

#include "frontend/console.h"
#include "frontend/pace.h"
#include "frontend/workflow/outside.h"
#include "frontend/workflow/run_options.h"

namespace relmap::workflow {

// How long a run waits for others. Tests wait less.
struct Waits {
  std::chrono::milliseconds look{50};           // between two looks at what may have changed
  std::chrono::milliseconds camera{1000};       // between two tries to open one
  std::chrono::milliseconds silence{5000};      // of a daemon, until that is said
  std::chrono::milliseconds slowed{15'000};     // for a daemon to ask again for fewer keyframes
  std::chrono::milliseconds news_silence{500};  // after which no more news is expected
  std::chrono::milliseconds news_most{10'000};  // for news, if there is no such silence
  double map_s = 5;                             // for a daemon to say which map it serves
  double end_s = 2;                             // for word that the end of a session is noted
};

inline constexpr std::size_t kMaxNamedLeftOut = 100'000;  // pictures and pairs of a recording

struct Run {
  // All of these must outlive it. The rate of its pairs counts from here.
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
  // Whether `status` says no more than that the run was to stop: then the sink takes nothing more, and the session goes
  // on there the next time.
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
