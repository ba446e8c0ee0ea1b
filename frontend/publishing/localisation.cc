#include "frontend/publishing/localisation.h"

#include <algorithm>

namespace relmap {

namespace {

// The daemon's lookups may be some thousand keyframes behind; what is older is not worth its memory.
constexpr std::size_t kPoses = 4096;
constexpr std::size_t kGuesses = 4096;
constexpr std::size_t kAnchors = 64;

template <typename T>
void push_bounded(std::deque<T>& queue, T value, std::size_t most) {
  queue.push_back(std::move(value));
  if (queue.size() > most) queue.pop_front();
}

}  // namespace

void Localisation::published(const Keyframe& keyframe) {
  const std::lock_guard lock(mutex_);
  push_bounded(poses_, {keyframe.sequence, keyframe.T_odom_frame}, kPoses);
  if (keyframe.source == MotionSource::kStart || is_vision(keyframe.source)) return;
  push_bounded(guesses_, keyframe.sequence, kGuesses);
  last_guess_ = keyframe.sequence;
  ++counts_.unmeasured_steps;
}

std::optional<SE3> Localisation::odometry(std::uint32_t sequence) const {
  const auto it = std::lower_bound(poses_.begin(), poses_.end(), sequence,
                                   [](const Pose& pose, std::uint32_t s) { return pose.sequence < s; });
  if (it == poses_.end() || it->sequence != sequence) return std::nullopt;
  return it->T_odom_keyframe;
}

std::optional<Localisation::Recovery> Localisation::hear(const PoseNews& news) {
  const std::lock_guard lock(mutex_);
  if (news.kind == PoseNews::Kind::kClosureOut) {
    ++counts_.withdrawn;
    std::erase_if(anchors_, [&](const Anchor& a) { return a.keyframe == news.keyframe && a.frame == news.frame; });
  }
  if (news.kind != PoseNews::Kind::kClosure) return std::nullopt;
  ++counts_.closures;
  if (const auto T_odom_keyframe = odometry(news.keyframe.index))
    push_bounded(anchors_, {news.keyframe, news.frame, news.T_frame_keyframe * T_odom_keyframe->inverse()}, kAnchors);

  const bool own = news.frame.session == news.keyframe.session;
  const auto closed = std::erase_if(guesses_, [&](std::uint32_t sequence) {
    return sequence <= news.keyframe.index && !(own && sequence <= news.frame.index);
  });
  if (closed == 0) return std::nullopt;
  counts_.recovered_steps += closed;
  return Recovery{news.keyframe, news.frame, news.T_frame_keyframe.t.norm(), closed};
}

std::optional<Localisation::Place> Localisation::place() const {
  const std::lock_guard lock(mutex_);
  const auto newest = std::max_element(anchors_.begin(), anchors_.end(), [](const Anchor& a, const Anchor& b) {
    return a.keyframe.index < b.keyframe.index;
  });
  if (newest == anchors_.end() || (last_guess_ && newest->keyframe.index < *last_guess_)) return std::nullopt;
  return Place{newest->frame, newest->T_frame_odom * poses_.back().T_odom_keyframe, newest->keyframe};
}

Localisation::Counts Localisation::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace relmap
