#include "server/monitor/health.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "proto/base/number_text.h"

namespace relmap::monitor {

namespace {

Status stalled(const std::string& what, double seconds) {
  return {Reason::STALLED, what + " for " + fixed(seconds, 1) + " s"};
}

// A full disk is told before somebody finds out by sending something.
Status judge_storage(const Signs& signs) {
  const map::MapperProgress& map = signs.map;
  if (!map.storage.ok()) return map.storage;
  if (signs.free_bytes < signs.low_water)
    return {Reason::DISK_FULL, std::to_string(signs.free_bytes >> 20) + " MiB free; nothing is taken in below " +
                                   std::to_string(signs.low_water >> 20) + " MiB"};
  if (map.journal_s > kStalled_s)
    return stalled("an append to the journal has been waiting for the disk", map.journal_s);
  if (map.commit_s > kStalled_s) return stalled("a commit has been waiting for the disk", map.commit_s);
  return {};
}

Status judge_worker(const map::MapperProgress& map) {
  if (map.worker_s > kStalled_s) return stalled("the worker has been at one record", map.worker_s);
  if (map.queued_s > kStalled_s) return stalled("a record has been waiting for the worker", map.queued_s);
  return {};
}

Status judge_intake(const Signs& signs) {
  if (signs.stopping) return {Reason::SHUTTING_DOWN, "the daemon is stopping"};
  if (signs.intake_s > kStalled_s) return stalled("robots have not been answered", signs.intake_s);
  return signs.lcm;
}

}  // namespace

rpc::HealthFacts judge(const Signs& signs) {
  rpc::HealthFacts health;
  health.components = {
      {"storage", judge_storage(signs)}, {"worker", judge_worker(signs.map)}, {"intake", judge_intake(signs)}};
  health.live = std::max({signs.map.journal_s, signs.map.worker_s, signs.intake_s}) <= signs.hung_after_s &&
                signs.map.commit_s <= kCommitHung_s;
  return health;
}

std::string health_page(const rpc::HealthFacts& health, bool ready_asked) {
  std::string page = ready_asked ? (health.ready() ? "ok\n" : "not ready\n") : (health.live ? "ok\n" : "not live\n");
  for (const rpc::ComponentHealth& component : health.components)
    page += component.name + ": " + (component.state.ok() ? "ok" : component.state.to_string()) + "\n";
  constexpr double kTold_s = 3600;
  if (health.clock_steps > 0 && health.clock_step_age_s < kTold_s)
    page += "clock: set " + std::string(health.clock_step_s > 0 ? "forward" : "back") + " by " +
            fixed(std::abs(health.clock_step_s), 1) + " s, " + fixed(health.clock_step_age_s, 0) + " s ago\n";
  return page;
}

std::string in_short(const rpc::HealthFacts& health) {
  std::string text;
  for (const rpc::ComponentHealth& component : health.components)
    if (!component.state.ok()) text += (text.empty() ? "" : "; ") + component.name + ": " + component.state.to_string();
  return text.empty() ? "ok" : text;
}

}  // namespace relmap::monitor
