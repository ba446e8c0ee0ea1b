#include "frontend/capture/first_pairs.h"

#include <utility>

#include "frontend/vision/exposure.h"

namespace relmap::capture {

namespace {

constexpr int kPlenty = 10, kMotions = 4;
constexpr int kMaxLooked = 40, kMaxForMotion = 20;
constexpr int kMinCorners = 20;             // shared by both eyes, for a pair to count
constexpr std::int64_t kApartUs = 500'000;  // between pairs
// The picture that shows the motion is taken within this time after a pair.
constexpr std::int64_t kSoonestMotionUs = 80'000, kLatestMotionUs = 350'000;

}  // namespace

bool FirstPairs::enough() const {
  if (held_) return false;
  if (with_corners_ < kPlenty) return looked_ >= kMaxLooked;
  return check_.motions() >= kMotions || looked_ >= kMaxForMotion;
}

bool FirstPairs::wants(std::int64_t time_us) const {
  if (enough()) return false;
  // If the clock was set back, any pair is wanted.
  return !next_us_ || time_us >= *next_us_ || time_us < *next_us_ - kApartUs;
}

void FirstPairs::take(StereoFrame raw) {
  const std::int64_t time_us = raw.time_us;
  if (held_ && raw.left.empty()) return;
  auto frame = rectify(rectifier_, std::move(raw));
  if (held_) {
    const std::int64_t held_us = held_->time_us, passed_us = time_us - held_us;
    const bool tells = frame.ok() && passed_us > 0 && passed_us <= kLatestMotionUs;
    look(tells ? vision::ImageView(frame->left) : vision::ImageView());
    next_us_ = held_us + kApartUs;
    if (!wants(time_us)) return;
  }
  if (!frame.ok() || frame->left.empty() || frame->right.empty()) {
    ++looked_;
    next_us_ = time_us + kApartUs;
    return;
  }
  next_us_ = time_us + kSoonestMotionUs;
  held_ = std::move(*frame);
}

void FirstPairs::look(vision::ImageView later) {
  const StereoFrame pair = std::move(*held_);
  held_.reset();
  ++looked_;
  const bool left_blind = vision::measure_exposure(pair.left).blind(),
             right_blind = vision::measure_exposure(pair.right).blind();
  if (left_blind && right_blind) return;  // if both are blind, the camera is covered or it is dark
  if (left_blind || right_blind) {
    (void)one_eyed_.add(pair.left, pair.right);
    return;
  }
  const int before = check_.matches();
  if (!check_.add(pair.left, pair.right, later).ok()) return;
  both_see_ = true;
  with_corners_ += check_.matches() - before >= kMinCorners;
}

vision::RigReport FirstPairs::report() {
  if (held_) look({});
  return both_see_ ? check_.report() : one_eyed_.report();
}

}  // namespace relmap::capture
