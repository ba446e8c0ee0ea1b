#include "server/monitor/health.h"

#include <algorithm>
#include <string>

#include "proto/base/number_text.h"

namespace relmap::monitor {

namespace {

Status stalled(const std::string& what, double seconds) {
  return {Reason::STALLED, what + " for " + fixed(seconds, 1) + " s"};
}

Status judge_storage(const map::MapperProgress& map) {
  if (!map.storage.ok()) return map.storage;
  if (map.journal_s > kStalled_s)
    return stalled("an append to the journal has been waiting for the disk", map.journal_s);
  if (map.commit_s > kStalled_s) return stalled("a commit has been waiting for the disk", map.commit_s);
  return {};
}

Status judge_worker(const map::MapperProgress& map) {
  if (map.worker_s > kStalled_s)
    return stalled("the worker has been at one record, or waiting for a commit,", map.worker_s);
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
      {"storage", judge_storage(signs.map)}, {"worker", judge_worker(signs.map)}, {"intake", judge_intake(signs)}};
  health.live = std::max({signs.map.journal_s, signs.map.worker_s, signs.intake_s}) <= signs.hung_after_s;
  return health;
}

std::string health_page(const rpc::HealthFacts& health, bool ready_asked) {
  std::string page = ready_asked ? (health.ready() ? "ok\n" : "not ready\n") : (health.live ? "ok\n" : "not live\n");
  for (const rpc::ComponentHealth& component : health.components)
    page += component.name + ": " + (component.state.ok() ? "ok" : component.state.to_string()) + "\n";
  return page;
}

std::string in_short(const rpc::HealthFacts& health) {
  std::string text;
  for (const rpc::ComponentHealth& component : health.components)
    if (!component.state.ok()) text += (text.empty() ? "" : "; ") + component.name + ": " + component.state.to_string();
  return text.empty() ? "ok" : text;
}

}  // namespace relmap::monitor
