#include "frontend/publishing/localisation.h"

#include <algorithm>

#include "proto/base/mutex.h"

namespace relmap::publishing {

namespace {

// The daemon's lookups may be some thousand keyframes behind; older ones are not worth the memory.
constexpr std::size_t kMaxPoses = 4096;
constexpr std::size_t kMaxClosures = 4096;

}  // namespace

void Localisation::publishing(const Keyframe& keyframe) {
  const MutexLock lock(mutex_);
  poses_.push_back({keyframe.sequence, keyframe.T_odom_frame});
  if (poses_.size() > kMaxPoses) poses_.pop_front();
  if (keyframe.source == MotionSource::kStart || is_vision(keyframe.source)) return;
  guesses_.push_back({keyframe.sequence, 0});
  if (guesses_.size() > kMaxPoses) guesses_.pop_front();
  ++counts_.unmeasured_steps;
}

std::optional<SE3> Localisation::odometry(std::uint32_t sequence) const {
  const auto it = std::lower_bound(poses_.begin(), poses_.end(), sequence,
                                   [](const Pose& pose, std::uint32_t s) { return pose.sequence < s; });
  if (it == poses_.end() || it->sequence != sequence) return std::nullopt;
  return it->T_odom_keyframe;
}

// Counts the closure in (or, if it is no longer in force, out) at each unmeasured step that it bridges. Returns the
// number of steps that are bridged by it alone.
std::uint64_t Localisation::bridge(const Ends& ends, bool in_force) {
  const auto& [keyframe, frame] = ends;
  std::uint64_t changed = 0;
  for (Guess& guess : guesses_) {
    const bool before = frame.session != keyframe.session || frame.index < guess.sequence;
    if (!before || guess.sequence > keyframe.index) continue;
    guess.closures += in_force ? 1 : -1;
    changed += guess.closures == (in_force ? 1 : 0);
  }
  return changed;
}

std::optional<Localisation::Recovery> Localisation::hear(const PoseNews& news) {
  const MutexLock lock(mutex_);
  ++counts_.heard;
  if (news.kind != PoseNews::Kind::kClosure && news.kind != PoseNews::Kind::kClosureOut) return std::nullopt;
  if (news.keyframe.session != session_) {  // another map, to which the closures so far do not apply
    closures_.clear();
    for (Guess& guess : guesses_) guess.closures = 0;
    session_ = news.keyframe.session;
    counts_.recovered_steps = 0;
  }
  const Ends ends(news.keyframe, news.frame);
  if (news.kind == PoseNews::Kind::kClosureOut) {
    if (closures_.erase(ends) == 0) return std::nullopt;
    ++counts_.withdrawn;
    counts_.recovered_steps -= bridge(ends, false);
    return std::nullopt;
  }
  // A closure that is older than all that are kept would be forgotten at once, and be new when it is told again.
  if (closures_.size() >= kMaxClosures && ends < closures_.begin()->first) return std::nullopt;
  const auto [closure, is_new] = closures_.try_emplace(ends);
  if (!is_new) return std::nullopt;
  if (const auto T_odom_keyframe = odometry(news.keyframe.index))
    closure->second = news.T_frame_keyframe * T_odom_keyframe->inverse();
  ++counts_.closures;
  const std::uint64_t steps = bridge(ends, true);
  counts_.recovered_steps += steps;
  if (closures_.size() > kMaxClosures) {  // a forgotten closure could not be taken out, so it no longer bridges a step
    const Ends oldest = closures_.begin()->first;
    closures_.erase(closures_.begin());
    counts_.recovered_steps -= bridge(oldest, false);
  }
  if (steps == 0) return std::nullopt;
  return Recovery{news.keyframe, news.frame, news.T_frame_keyframe.t.norm(), steps};
}

std::optional<Localisation::Place> Localisation::place() const {
  const MutexLock lock(mutex_);
  const auto newest =
      std::find_if(closures_.rbegin(), closures_.rend(), [](const auto& entry) { return entry.second.has_value(); });
  if (newest == closures_.rend()) return std::nullopt;
  const auto& [keyframe, frame] = newest->first;
  if (!guesses_.empty() && keyframe.index < guesses_.back().sequence) return std::nullopt;
  return Place{frame, *newest->second * poses_.back().T_odom_keyframe, keyframe};
}

Localisation::Counts Localisation::counts() const {
  const MutexLock lock(mutex_);
  return counts_;
}

}  // namespace relmap::publishing
