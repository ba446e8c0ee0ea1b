#include "server/skeleton/chain_points.h"

#include <algorithm>
#include <cmath>

#include "server/skeleton/level.h"

namespace relmap::skeleton {

using storage::ChunkDigest;
using storage::FrameDigest;

namespace {

constexpr double kUnknown = 1e6;  // in place of a variance that is no number

double known(double variance) { return std::isfinite(variance) && variance >= 0 ? variance : kUnknown; }

// The covariance of a chain of steps by its traces, if those of each step are the same in all directions: an error of
// the rotation at one place moves the end by its distance from there.
class Spread {
 public:
  void add(const FrameDigest& step, const Vector3& place) {
    const double rotation = known(step.rotation_variance);
    translation_ += known(step.translation_variance);
    rotation_ += rotation;
    moment_ += rotation * place;
    square_ += rotation * place.squaredNorm();
  }
  double rotation() const { return rotation_; }
  double translation(const Vector3& end) const {
    const double lever = rotation_ * end.squaredNorm() - 2 * end.dot(moment_) + square_;
    return translation_ + 2.0 / 3 * std::max(0.0, lever);
  }

 private:
  double translation_ = 0, rotation_ = 0, square_ = 0;
  Vector3 moment_ = Vector3::Zero();
};

double distance(const Vector3& point, const Vector3& a, const Vector3& b) {
  const Vector3 chord = b - a;
  const double square = chord.squaredNorm();
  const double share = square > 0 ? std::clamp((point - a).dot(chord) / square, 0.0, 1.0) : 0;
  return (point - a - share * chord).norm();
}

}  // namespace

void ChainContraction::add(const ChunkDigest& chunk, std::uint64_t kept, std::vector<Chain>& chains) {
  if (last_ && last_->session != chunk.id.session) {
    last_.reset();
    open_ = false;
  }
  std::uint32_t left = storage::kFramesPerChunk / stride(level_) - 1;
  std::vector<Place> piece;
  const auto close = [&] {
    if (piece.empty()) return;
    piece.back().kept = true;
    keep_bends(piece, left);
    emit(piece, chunk.id, chains);
    piece.clear();
  };
  for (std::size_t i = 0; i < chunk.frames.size(); ++i) {
    const FrameDigest& frame = chunk.frames[i];
    const bool joined = is_joined(frame) && (last_ || i > 0);
    if (!joined) {
      close();
      open_ = false;
      piece.push_back({&frame, {}, true});
      continue;
    }
    if (piece.empty()) piece.push_back({nullptr, {}, true});
    const FrameDigest* const before = piece.back().frame;
    // Where what is known of the motion changes, so that a step is a guess, or was carried, as a whole.
    if (before && (before->unmeasured != frame.unmeasured || before->carried != frame.carried))
      piece.back().kept = true;
    const bool must = level_ == kAll || ((kept >> frame.slot) & 1);
    piece.push_back({&frame, piece.back().pose * frame.T_previous_frame, must});
  }
  close();
}

// Keeps up to `left` frames: one after another that at which the way is farthest from the line between the points
// around it.
void ChainContraction::keep_bends(std::vector<Place>& piece, std::uint32_t& left) const {
  if (left == 0 || level_ == kAll || piece.size() < 3) return;
  double length = 0;
  for (std::size_t i = 1; i < piece.size(); ++i) length += (piece[i].pose.t - piece[i - 1].pose.t).norm();
  struct Bend {
    double off = 0;
    std::size_t begin = 0, at = 0, end = 0;
  };
  const auto bend_between = [&](std::size_t begin, std::size_t end) {
    Bend bend{0, begin, begin, end};
    for (std::size_t i = begin + 1; i < end; ++i)
      if (const double off = distance(piece[i].pose.t, piece[begin].pose.t, piece[end].pose.t); off > bend.off)
        bend = {off, begin, i, end};
    return bend;
  };
  std::vector<Bend> bends;
  for (std::size_t begin = 0, i = 1; i < piece.size(); ++i)
    if (piece[i].kept) {
      bends.push_back(bend_between(begin, i));
      begin = i;
    }
  for (; left > 0; --left) {
    const auto most =
        std::max_element(bends.begin(), bends.end(), [](const Bend& l, const Bend& r) { return l.off < r.off; });
    if (most == bends.end() || !(most->off > tolerance(level_) * length)) return;
    const Bend bend = *most;
    piece[bend.at].kept = true;
    *most = bend_between(bend.begin, bend.at);
    bends.push_back(bend_between(bend.at, bend.end));
  }
}

void ChainContraction::emit(const std::vector<Place>& piece, storage::ChunkId chunk, std::vector<Chain>& chains) {
  if (!open_) {
    Chain& begun = chains.emplace_back();
    begun.session = chunk.session;
    if (!piece.front().frame) begun.points.push_back({.index = last_->index, .time_us = last_time_us_});
    open_ = true;
  }
  Chain& chain = chains.back();
  Spread spread;
  const Place* from = &piece.front();
  if (from->frame)
    chain.points.push_back({.index = frame_in(chunk, from->frame->slot).index, .time_us = from->frame->time_us});
  Point step;
  for (std::size_t i = 1; i < piece.size(); ++i) {
    const FrameDigest& frame = *piece[i].frame;
    spread.add(frame, piece[i].pose.t);
    ++step.frames;
    step.unmeasured = step.unmeasured || frame.unmeasured;
    step.carried = step.carried || frame.carried;
    if (!piece[i].kept) continue;
    step.index = frame_in(chunk, frame.slot).index;
    step.time_us = frame.time_us;
    step.T_before_this = from->pose.inverse() * piece[i].pose;
    step.translation_variance = static_cast<float>(spread.translation(piece[i].pose.t));
    step.rotation_variance = static_cast<float>(spread.rotation());
    chain.points.push_back(step);
    step = {};
    spread = {};
    from = &piece[i];
  }
  const Place& end = piece.back();
  if (!end.frame) return;
  last_ = frame_in(chunk, end.frame->slot);
  last_time_us_ = end.frame->time_us;
}

}  // namespace relmap::skeleton
