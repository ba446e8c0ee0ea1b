#include "server/rpc/route_request.h"

#include <cmath>
#include <string>

#include "proto/base/bytes.h"
#include "proto/base/crc32c.h"
#include "proto/wire/convert.h"
#include "server/route/alternatives.h"
#include "server/route/newest_frame.h"
#include "server/route/refusal.h"
#include "server/rpc/handlers.h"
#include "server/rpc/limits.h"
#include "server/rpc/messages.h"
#include "server/rpc/place_messages.h"

namespace relmap::rpc {

namespace {

constexpr int kMaxEnds = 100;  // alternatives; few of them may be pictures, since each takes time
constexpr std::size_t kMaxPictures = 4;
constexpr std::size_t kMaxRouteFrames = 10'000;  // at an end, or to be avoided
constexpr int kMaxAvoidedLabels = 100;

Status too_many(const char* what, std::size_t max_count) {
  return {Reason::INVALID_ARGUMENT, "more than " + std::to_string(max_count) + ' ' + what};
}

Status add_end(map::Mapper& mapper, const storage::MapView& view, const v1::RouteEnd& end, const char* what,
               const Deadline& deadline, RouteEnds& ends) {
  switch (end.end_case()) {
    case v1::RouteEnd::kFrame: {
      const auto frame = existing_frame(view, true, end.frame(), what);
      if (!frame.ok()) return frame.status();
      ends.frames.push_back(*frame);
      return {};
    }
    case v1::RouteEnd::kLabel: {
      const std::vector<FrameId> labelled = view.labelled(end.label());
      if (labelled.empty()) return {Reason::NO_SUCH_LABEL, "no frame is labelled '" + end.label() + "'"};
      ends.frames.insert(ends.frames.end(), labelled.begin(), labelled.end());
      return {};
    }
    case v1::RouteEnd::kView: {
      if (ends.seen.by_frame.size() == kMaxPictures) return too_many("pictures at one end", kMaxPictures);
      auto seen = localise_view(mapper, view, end.view(), std::nullopt, deadline);
      if (!seen.ok()) return seen.status();
      const auto frame = from_wire(seen->frame());
      if (!frame.ok()) return frame.status();
      ends.frames.push_back(*frame);
      ends.seen.by_frame.insert_or_assign(*frame, std::move(seen).value());
      return {};
    }
    case v1::RouteEnd::kRobot: {
      const auto frame = route::newest_frame(view, end.robot());
      if (!frame.ok()) return frame.status();
      ends.frames.push_back(*frame);
      return {};
    }
    case v1::RouteEnd::END_NOT_SET:
      break;
  }
  return {Reason::INVALID_ARGUMENT, std::string(what) + " is missing"};
}

Result<route::RouteWeights> weights_of(const v1::FindRouteRequest& request) {
  if (request.has_weights()) {
    if (request.by() != v1::ROUTE_BY_UNSPECIFIED)
      return {Reason::INVALID_ARGUMENT, "a route is either by weights or by one of the kinds, not both"};
    const v1::RouteWeights& given = request.weights();
    const route::RouteWeights weights{given.metre(), given.driven_second(), given.standing_second(),
                                      given.square_metre_of_variance()};
    if (Status valid = route::check_weights(weights); !valid.ok()) return valid;
    return weights;
  }
  switch (request.by()) {
    case v1::ROUTE_BY_UNSPECIFIED:
    case v1::ROUTE_BY_DISTANCE:
      return route::kByDistance;
    case v1::ROUTE_BY_TIME:
      return request.count_standing() ? route::kByTimeStandingToo : route::kByTime;
    case v1::ROUTE_BY_CERTAINTY:
      return route::kByCertainty;
    default:
      return {Reason::INVALID_ARGUMENT, "a route is by distance, by time, by certainty or by weights"};
  }
}

Result<route::RouteFilter> filter_of(const storage::Graph& map, const v1::RouteFilter& given,
                                     const Deadline& deadline) {
  if (given.sessions_size() > kMaxNamedSessions) return too_many("sessions", kMaxNamedSessions);
  if (given.avoid_labels_size() > kMaxAvoidedLabels) return too_many("labels to be avoided", kMaxAvoidedLabels);
  route::RouteFilter filter;
  for (const SessionNumber number : given.sessions()) {
    if (const auto session = storage::existing_session(map, number); !session.ok()) return session.status();
    filter.sessions.insert(number);
  }
  if (static_cast<std::size_t>(given.avoid_frames_size()) > kMaxRouteFrames)
    return too_many("frames to be avoided", kMaxRouteFrames);
  for (const v1::FrameId& avoided : given.avoid_frames()) {
    const auto frame = existing_frame(map, true, avoided, "the frame to be avoided");
    if (!frame.ok()) return frame.status();
    filter.avoided.insert(*frame);
  }
  for (const std::string& label : given.avoid_labels()) {
    const std::vector<FrameId> labelled = map.labelled(label);
    if (labelled.empty()) return {Reason::NO_SUCH_LABEL, "no frame is labelled '" + label + "'"};
    filter.avoided.insert(labelled.begin(), labelled.end());
    if (filter.avoided.size() > kMaxRouteFrames) return too_many("frames to be avoided", kMaxRouteFrames);
    if (Status status = deadline.check(); !status.ok()) return status;
  }
  filter.min_support = given.min_support();
  filter.long_loops = !given.no_long_loops();
  filter.supposed = {
      .candidates = given.suppose_candidates(), .quarantined = given.suppose_quarantined(), .bound = true};
  return filter;
}

}  // namespace

std::size_t SeenEnds::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& [frame, seen] : by_frame) bytes += sizeof frame + seen.SpaceUsedLong();
  return bytes;
}

Result<RouteEnds> route_ends(map::Mapper& mapper, const storage::MapView& view, const v1::RouteEnd& end,
                             const google::protobuf::RepeatedPtrField<v1::RouteEnd>& others, const char* what,
                             const Deadline& deadline) {
  if (others.size() > kMaxEnds) return too_many("alternatives at one end", kMaxEnds);
  RouteEnds ends;
  const auto add = [&](const v1::RouteEnd& one) {
    Status status = add_end(mapper, view, one, what, deadline, ends);
    if (status.ok()) status = deadline.check();
    return status.ok() && ends.frames.size() > kMaxRouteFrames ? too_many("frames at one end", kMaxRouteFrames)
                                                               : status;
  };
  if (Status status = add(end); !status.ok()) return status;
  for (const v1::RouteEnd& other : others)
    if (Status status = add(other); !status.ok()) return status;
  return ends;
}

std::uint32_t route_fingerprint(const v1::FindRouteRequest& request) {
  v1::FindRouteRequest asked = request;
  asked.clear_resume_token();
  asked.clear_from();
  asked.clear_to();
  asked.clear_or_from();
  asked.clear_or_to();
  return crc32c(as_bytes(asked.SerializeAsString()));
}

std::uint32_t route_ends_fingerprint(const v1::FindRouteRequest& request) {
  v1::FindRouteRequest asked;
  if (request.has_from()) *asked.mutable_from() = request.from();
  if (request.has_to()) *asked.mutable_to() = request.to();
  *asked.mutable_or_from() = request.or_from();
  *asked.mutable_or_to() = request.or_to();
  return crc32c(as_bytes(asked.SerializeAsString()));
}

Result<route::RouteOptions> route_options(const storage::Graph& map, const v1::FindRouteRequest& request,
                                          const Deadline& deadline) {
  route::RouteOptions options;
  const auto weights = weights_of(request);
  if (!weights.ok()) return weights.status();
  options.weights = *weights;
  options.count_standing = request.count_standing();
  auto filter = filter_of(map, request.filter(), deadline);
  if (!filter.ok()) return filter.status();
  options.filter = std::move(filter).value();
  if (request.alternatives() > route::kMaxAlternatives) return too_many("alternatives", route::kMaxAlternatives);
  if (!std::isfinite(request.max_cost()) || request.max_cost() < 0)
    return {Reason::INVALID_ARGUMENT, "max_cost must be 0 (no limit) or more"};
  if (request.max_cost() > 0) options.max_cost = request.max_cost();
  return options;
}

}  // namespace relmap::rpc
