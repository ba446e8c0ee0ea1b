#include "tools/console/layout/health_samples.h"

#include <nlohmann/json.hpp>
#include <utility>

namespace relmap::console {

HealthSamples::HealthSamples(HealthOptions options)
    : options_(std::move(options)), client_(options_.connect, options_.credentials), thread_([this] { run(); }) {}

HealthSamples::~HealthSamples() { stop(); }

void HealthSamples::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void HealthSamples::run() {
  for (;;) {
    const auto next = std::chrono::steady_clock::now() + options_.every;
    const HealthSample sample = take();
    const MutexLock lock(mutex_);
    samples_.push_back(sample);
    while (samples_.size() > options_.most) samples_.pop_front();
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(next - std::chrono::steady_clock::now());
    if (changed_.wait_for(mutex_, left, [this]() RELMAP_REQUIRES(mutex_) { return stopping_; })) return;
  }
}

HealthSample HealthSamples::take() {
  HealthSample sample;
  sample.time_ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  const auto client = client_.get();
  if (!client.ok()) return sample;
  const auto status = (*client)->status();
  if (!status.ok()) {
    client_.drop();
    return sample;
  }
  const auto now = std::chrono::steady_clock::now();
  sample.reachable = true;
  if (boot_id_ == status->boot_id && status->ingest_keyframes >= ingested_) {
    const double seconds = std::chrono::duration<double>(now - asked_).count();
    if (seconds > 0) sample.keyframes_per_s = static_cast<double>(status->ingest_keyframes - ingested_) / seconds;
  }
  boot_id_ = status->boot_id;
  ingested_ = status->ingest_keyframes;
  asked_ = now;
  sample.frames = status->frames;
  sample.queued = status->queued;
  sample.lookup_lag = status->lookup_lag;
  sample.pending_frames = status->pending_frames;
  sample.relaxation_p50_us = status->relaxation_p50_us;
  sample.relaxation_p99_us = status->relaxation_p99_us;
  sample.memory_used = status->memory_used;
  sample.memory_budget = status->memory_budget;
  sample.resident_bytes = status->resident_bytes;
  sample.refused = status->refused;
  sample.accepted = status->closures_accepted;
  sample.candidate = status->closures_candidate;
  sample.quarantined = status->closures_quarantined;
  sample.removed = status->closures_removed;
  if (taken_++ % options_.disk_every == 0)
    if (const auto stats = (*client)->stats(); stats.ok()) disk_bytes_ = stats->map_bytes + stats->journal_bytes;
  sample.disk_bytes = disk_bytes_;
  return sample;
}

std::deque<HealthSample> HealthSamples::samples() const {
  const MutexLock lock(mutex_);
  return samples_;
}

std::string HealthSamples::samples_json(std::int64_t since_ms, bool with_disk) const {
  using Document = nlohmann::ordered_json;
  Document told = Document::array();
  for (const HealthSample& s : samples()) {
    if (s.time_ms <= since_ms) continue;
    Document sample = {{"t", s.time_ms}, {"reachable", s.reachable}};
    if (s.reachable)
      sample.update({{"keyframes_per_s", s.keyframes_per_s},
                     {"frames", s.frames},
                     {"queued", s.queued},
                     {"lookup_lag", s.lookup_lag},
                     {"pending_frames", s.pending_frames},
                     {"relaxation_p50_us", s.relaxation_p50_us},
                     {"relaxation_p99_us", s.relaxation_p99_us},
                     {"memory_used", s.memory_used},
                     {"memory_budget", s.memory_budget},
                     {"resident_bytes", s.resident_bytes},
                     {"refused", s.refused},
                     {"accepted", s.accepted},
                     {"candidate", s.candidate},
                     {"quarantined", s.quarantined},
                     {"removed", s.removed}});
    if (s.reachable && with_disk) sample["disk_bytes"] = s.disk_bytes;
    told.push_back(std::move(sample));
  }
  return Document{{"every_ms", options_.every.count()}, {"samples", std::move(told)}}.dump();
}

}  // namespace relmap::console
