#include <charconv>
#include <cmath>
#include <memory>
#include <sstream>

#include "proto/wire/convert.h"
#include "server/route/dijkstra.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/place_messages.h"
#include "server/rpc/search_work.h"

namespace relmap {

namespace {

constexpr std::size_t kStepsPerMessage = 1000;  // of about 200 bytes, without labels
constexpr std::size_t kMaxLabelBytes = kUsualStreamMessageBytes / 4;

struct ResolvedEnd {
  std::vector<FrameId> frames;
  std::optional<v1::LocaliseReply> seen;
};

Result<ResolvedEnd> resolve_end(Core& core, const MapView& view, const v1::RouteEnd& end, const char* what,
                                const Deadline& deadline) {
  switch (end.end_case()) {
    case v1::RouteEnd::kFrame: {
      const auto frame = existing_frame(view, true, end.frame(), what);
      if (!frame.ok()) return frame.status();
      return ResolvedEnd{{*frame}, std::nullopt};
    }
    case v1::RouteEnd::kLabel: {
      ResolvedEnd resolved{view.labelled(end.label()), std::nullopt};
      if (resolved.frames.empty()) return {Reason::NO_SUCH_LABEL, "no frame is labelled '" + end.label() + "'"};
      return resolved;
    }
    case v1::RouteEnd::kView: {
      auto seen = localise_view(core, view, end.view(), std::nullopt, deadline);
      if (!seen.ok()) return seen.status();
      const auto frame = from_wire(seen->frame());
      if (!frame.ok()) return frame.status();
      return ResolvedEnd{{*frame}, std::move(seen).value()};
    }
    case v1::RouteEnd::END_NOT_SET:
      break;
  }
  return {Reason::INVALID_ARGUMENT, std::string(what) + " is missing"};
}

Result<RouteOptions> options_of(const v1::FindRouteRequest& request) {
  RouteOptions options;
  switch (request.by()) {
    case v1::ROUTE_BY_UNSPECIFIED:
    case v1::ROUTE_BY_DISTANCE:
      options.weights = kByDistance;
      break;
    case v1::ROUTE_BY_TIME:
      options.weights = request.count_standing() ? kByTimeStandingToo : kByTime;
      break;
    default:
      return {Reason::INVALID_ARGUMENT, "routes are by distance or by time"};
  }
  if (!std::isfinite(request.max_cost()) || request.max_cost() < 0)
    return {Reason::INVALID_ARGUMENT, "max_cost must be 0 (no limit) or more"};
  if (request.max_cost() > 0) options.max_cost = request.max_cost();
  return options;
}

v1::RouteStep step_message(const RouteStep& step) {
  v1::RouteStep message;
  *message.mutable_frame() = to_wire(step.frame);
  message.set_distance_m(step.distance_m);
  message.set_time_s(step.time_s);
  for (const std::string& label : step.labels) message.add_labels(label);
  if (!step.edge.valid()) return message;
  *message.mutable_edge() = to_wire(step.edge);
  message.set_kind(to_wire(step.kind));
  *message.mutable_to_next() = to_wire(step.T_to_next);
  message.set_long_loop(step.long_loop);
  return message;
}

// Where a stream broke: its ends, by which the same view gives the same route again, and its next step.
struct Position {
  FrameId from, to;
  std::size_t step = 0;

  std::string to_string() const { return from.to_string() + "," + to.to_string() + "," + std::to_string(step); }
  static std::optional<Position> parse(const std::string& text) {
    std::istringstream fields(text);
    std::string from, to, step;
    std::getline(fields, from, ',');
    std::getline(fields, to, ',');
    std::getline(fields, step);
    const auto from_id = FrameId::parse(from), to_id = FrameId::parse(to);
    Position position;
    const auto [end, error] = std::from_chars(step.data(), step.data() + step.size(), position.step);
    if (!from_id || !to_id || error != std::errc{} || end != step.data() + step.size()) return std::nullopt;
    position.from = *from_id;
    position.to = *to_id;
    return position;
  }
};

// Reads the steps from the view as the caller takes them.
class RouteStream {
 public:
  RouteStream(Core& core, std::shared_ptr<const MapView> view, Route route, const Deadline& deadline)
      : core_(core),
        view_(std::move(view)),
        route_(std::move(route)),
        deadline_(deadline),
        charge_(core.mapper.budget(), Share::kReplies),
        walk_(*view_, route_) {}

  Status charge() { return charge_.grow_to(route_.path.memory_bytes()); }

  // Steps that an earlier stream has brought, and the summary before them.
  Status skip(std::size_t steps) {
    summarised_ = steps > 0;
    for (; next_ < steps; ++next_) {
      if (next_ % kStepsPerMessage == 0)
        if (Status status = deadline_.check(); !status.ok()) return status;
      walk_.next();
    }
    return {};
  }

  Result<std::optional<v1::FindRouteReply>> take() {
    if (summarised_ && next_ >= route_.steps()) return std::optional<v1::FindRouteReply>();
    v1::FindRouteReply reply;
    if (!summarised_) *reply.mutable_summary() = summary();
    summarised_ = true;
    std::size_t label_bytes = 0;
    while (static_cast<std::size_t>(reply.steps_size()) < kStepsPerMessage && label_bytes < kMaxLabelBytes) {
      const auto step = walk_.next();
      if (!step) break;
      for (const std::string& label : step->labels) label_bytes += label.size() + 2;
      *reply.add_steps() = step_message(*step);
      ++next_;
    }
    if (next_ < route_.steps())
      reply.set_resume_token(core_.views.token(view_, Position{route_.path.from, route_.path.to, next_}.to_string()));
    return std::optional(std::move(reply));
  }

  std::optional<v1::LocaliseReply> from_view, to_view;

 private:
  v1::RouteSummary summary() const {
    v1::RouteSummary message;
    *message.mutable_from() = to_wire(route_.path.from);
    *message.mutable_to() = to_wire(route_.path.to);
    message.set_distance_m(route_.distance_m);
    message.set_time_s(route_.time_s);
    message.set_steps(static_cast<std::uint32_t>(route_.steps()));
    message.set_long_loops(route_.long_loops);
    message.set_frames_touched(route_.frames_touched);
    message.set_map_version(view_->version());
    if (from_view) *message.mutable_from_view() = *from_view;
    if (to_view) *message.mutable_to_view() = *to_view;
    return message;
  }

  Core& core_;
  const std::shared_ptr<const MapView> view_;
  const Route route_;
  const Deadline& deadline_;
  Charge charge_;
  RouteWalk walk_;
  std::size_t next_ = 0;
  bool summarised_ = false;
};

}  // namespace

bool needs_picture(const v1::FindRouteRequest& request) {
  return request.from().view().has_left() || request.to().view().has_left();
}

Result<Producer<v1::FindRouteReply>> find_route(Core& core, const v1::FindRouteRequest& request,
                                                const Deadline& deadline) {
  const auto options = options_of(request);
  if (!options.ok()) return options.status();
  auto opened = core.views.open(request.resume_token(), core.mapper.view());
  if (!opened.ok()) return opened.status();
  const MapView& view = *opened->view;

  ResolvedEnd from, to;
  std::size_t first_step = 0;
  if (!opened->position.empty()) {
    const auto position = Position::parse(opened->position);
    if (!position) return {Reason::INVALID_ARGUMENT, "the resume token is not one of a route"};
    from.frames = {position->from};
    to.frames = {position->to};
    first_step = position->step;
  } else {
    auto start = resolve_end(core, view, request.from(), "from", deadline);
    if (!start.ok()) return start.status();
    auto goal = resolve_end(core, view, request.to(), "to", deadline);
    if (!goal.ok()) return goal.status();
    from = std::move(start).value();
    to = std::move(goal).value();
  }

  SearchWork work(core, deadline);
  auto route = find_route(view, from.frames, to.frames, *options, work.limit());
  if (!route.ok()) return route.status();
  if (first_step >= route->steps()) return {Reason::INVALID_ARGUMENT, "the resume token is not one of this route"};
  const auto stream = std::make_shared<RouteStream>(core, opened->view, std::move(route).value(), deadline);
  stream->from_view = std::move(from.seen);
  stream->to_view = std::move(to.seen);
  if (Status status = stream->charge(); !status.ok()) return status;
  if (Status status = stream->skip(first_step); !status.ok()) return status;
  return Producer<v1::FindRouteReply>([stream] { return stream->take(); });
}

}  // namespace relmap
