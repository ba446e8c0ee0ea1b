#include "storage/graph/digest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "proto/geometry/covariance.h"

namespace relmap::storage {

namespace {

template <typename Number>
std::uint16_t at_most_16_bits(Number count) {
  return static_cast<std::uint16_t>(std::min<std::size_t>(count, std::numeric_limits<std::uint16_t>::max()));
}

float trace_of(const Matrix6& covariance, int first) {
  return static_cast<float>(covariance.diagonal().segment<3>(first).sum());
}

bool is_contradiction(Reason reason) {
  return reason == Reason::INCONSISTENT || reason == Reason::CONTRADICTS_MOTION || reason == Reason::LOOKS_ALIKE ||
         reason == Reason::NOT_SEEN_BEYOND;
}

// Why the daemon left the closure in its state, by its own judgement: what operators did is passed over.
Reason last_verdict(const Edge& closure) {
  for (auto event = closure.history.rbegin(); event != closure.history.rend(); ++event)
    if (event->reason != Reason::ACCEPTED_BY_OPERATOR && event->reason != Reason::REMOVED_BY_OPERATOR)
      return event->reason;
  return closure.reason;
}

}  // namespace

float tension_of(const Edge& closure) {
  if (!is_metric(closure.verification)) return 0;
  const Vector6 moved = (closure.prior_T_ab.inverse() * closure.T_ab).log();
  const double squared = mahalanobis_squared(moved, closure.prior_covariance);
  return std::isfinite(squared) && squared > 0 ? static_cast<float>(std::sqrt(squared)) : 0;
}

ClosureDigest digest_of(const Edge& closure) {
  const auto contradicted = [](const EdgeEvent& event) { return is_contradiction(event.reason); };
  return {
      .id = closure.id,
      .a = closure.a,
      .kind = closure.kind,
      .state = closure.state,
      .reason = closure.reason,
      .verification = closure.verification,
      .carries = closure.carries,
      .T_ab = closure.T_ab,
      .translation_variance = trace_of(closure.covariance, 0),
      .rotation_variance = trace_of(closure.covariance, 3),
      .inliers = closure.inliers,
      .bound = closure.bound,
      .support = closure.support,
      .probability = closure.probability,
      .spread = closure.spread,
      .agreeing = at_most_16_bits(closure.consistent_with.size()),
      .unseen = at_most_16_bits(closure.unseen.size()),
      .tension = tension_of(closure),
      .was_contradicted = std::any_of(closure.history.begin(), closure.history.end(), contradicted),
      .looks_alike = last_verdict(closure) == Reason::LOOKS_ALIKE,
      .carried = closure.carried.session != 0,
      .uniqueness = closure.uniqueness,
      .tests = closure.tests,
  };
}

FrameDigest digest_of(FrameId id, const FrameHot& frame) {
  FrameDigest digest{.slot = slot_of(id), .time_us = frame.time_us, .labelled = !frame.labels.empty()};
  if (const Edge* motion = motion_to(frame)) {
    digest.joined = true;
    digest.T_previous_frame = motion->T_ab;
    digest.translation_variance = trace_of(motion->covariance, 0);
    digest.rotation_variance = trace_of(motion->covariance, 3);
    digest.driven_s = motion->driven_s;
    digest.unmeasured = is_unmeasured(*motion);
    digest.carried = !motion->carried_by.empty();
    digest.source = motion->source;
  }
  for (const Edge& edge : frame.edges)
    if (edge.id.ordinal > 0) digest.closures.push_back(digest_of(edge));
  return digest;
}

}  // namespace relmap::storage
