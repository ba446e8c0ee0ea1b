#include <cmath>

#include "client/enum_reply.h"
#include "client/replies.h"
#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"

namespace relmap::client {
namespace {

constexpr char kMalformed[] = "the daemon's reply has a malformed skeleton";

// The transform in the six numbers from `numbers`, and the two variances from `variances`; false if they are none.
bool read_step(const float* numbers, const float* variances, SE3& T, double& translation, double& rotation) {
  for (int i = 0; i < 6; ++i)
    if (!std::isfinite(numbers[i])) return false;
  T.t = {numbers[0], numbers[1], numbers[2]};
  T.R = so3_exp({numbers[3], numbers[4], numbers[5]});
  translation = variances[0];
  rotation = variances[1];
  return std::isfinite(translation) && std::isfinite(rotation) && translation >= 0 && rotation >= 0;
}

Status read_chain(const v1::SkeletonChain& message, Skeleton::Chain& chain) {
  const int points = message.index_size();
  if (points < 1 || message.time_ms_size() != points || message.step_size() != 6 * (points - 1) ||
      message.variance_size() != 2 * (points - 1) || message.frames_size() != points - 1)
    return {Reason::CORRUPT, kMalformed};
  chain.session = message.session();
  chain.points.resize(static_cast<std::size_t>(points));
  std::uint32_t index = 0;
  std::uint64_t time_ms = 0;
  for (int i = 0; i < points; ++i) {
    Skeleton::Point& point = chain.points[static_cast<std::size_t>(i)];
    index += message.index(i);
    time_ms += static_cast<std::uint64_t>(message.time_ms(i));
    point.frame = {message.session(), index};
    point.time_us = static_cast<std::int64_t>(1000 * time_ms);
    if (i == 0) continue;
    if (message.index(i) == 0 || index < message.index(i)) return {Reason::CORRUPT, kMalformed};
    point.frames = message.frames(i - 1);
    if (!read_step(message.step().data() + 6 * (i - 1), message.variance().data() + 2 * (i - 1), point.T_before_this,
                   point.translation_variance, point.rotation_variance))
      return {Reason::CORRUPT, kMalformed};
  }
  for (const std::uint32_t i : message.unmeasured()) {
    if (i == 0 || i >= chain.points.size()) return {Reason::CORRUPT, kMalformed};
    chain.points[i].unmeasured = true;
  }
  for (const std::uint32_t i : message.carried()) {
    if (i == 0 || i >= chain.points.size()) return {Reason::CORRUPT, kMalformed};
    chain.points[i].carried = true;
  }
  return {};
}

// A chain that goes on from one message to the next.
bool goes_on(const Skeleton::Chain& before, const Skeleton::Chain& chain) {
  return before.points.back().frame == chain.points.front().frame;
}

}  // namespace

Status read_skeleton_part(const v1::GetSkeletonReply& message, Skeleton& skeleton) {
  skeleton.map_version = message.map_version();
  skeleton.commit_number = message.commit_number();
  skeleton.frames_done = message.frames_done();
  skeleton.frames = message.frames_total();
  for (const v1::SkeletonChain& told : message.chains()) {
    Skeleton::Chain chain;
    if (Status read = read_chain(told, chain); !read.ok()) return read;
    if (!skeleton.chains.empty() && goes_on(skeleton.chains.back(), chain)) {
      auto& points = skeleton.chains.back().points;
      points.insert(points.end(), chain.points.begin() + 1, chain.points.end());
    } else {
      skeleton.chains.push_back(std::move(chain));
    }
  }
  const v1::SkeletonClosures& told = message.closures();
  const int closures = told.session_b_size();
  for (const int size : {told.index_b_size(), told.ordinal_size(), told.session_a_size(), told.index_a_size(),
                         told.state_size(), told.carries_size(), told.suspicion_size(), told.alike_size()})
    if (size != closures) return {Reason::CORRUPT, kMalformed};
  if (told.a_from_b_size() != 6 * closures || told.variance_size() != 2 * closures)
    return {Reason::CORRUPT, kMalformed};
  skeleton.closures.reserve(skeleton.closures.size() + static_cast<std::size_t>(closures));
  for (int i = 0; i < closures; ++i) {
    Skeleton::Closure closure;
    closure.id = {{told.session_b(i), told.index_b(i)}, told.ordinal(i)};
    closure.a = {told.session_a(i), told.index_a(i)};
    if (closure.a == closure.id.frame || told.alike(i) == 0) return {Reason::CORRUPT, kMalformed};
    if (Status read = read_enum(told.state(i), closure.state); !read.ok()) return read;
    closure.carries = told.carries(i);
    closure.suspicion = told.suspicion(i);
    closure.alike = told.alike(i);
    if (!read_step(told.a_from_b().data() + 6 * i, told.variance().data() + 2 * i, closure.T_ab,
                   closure.translation_variance, closure.rotation_variance))
      return {Reason::CORRUPT, kMalformed};
    skeleton.closures.push_back(closure);
  }
  return {};
}

}  // namespace relmap::client
