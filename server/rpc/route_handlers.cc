#include <algorithm>
#include <charconv>
#include <memory>
#include <sstream>

#include "proto/wire/convert.h"
#include "server/route/dijkstra.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/route_request.h"
#include "server/rpc/search_work.h"

namespace relmap {

namespace {

constexpr std::size_t kStepsPerMessage = 1000;               // of about 200 bytes, without labels
constexpr std::size_t kStepsWithCovariancePerMessage = 400;  // of about 450
constexpr std::size_t kMaxLabelBytes = kUsualStreamMessageBytes / 4;

v1::RouteStep step_message(const RouteStep& step, bool covariance) {
  v1::RouteStep message;
  *message.mutable_frame() = to_wire(step.frame);
  message.set_distance_m(step.distance_m);
  message.set_time_s(step.time_s);
  for (const std::string& label : step.labels) message.add_labels(label);
  if (covariance) {
    *message.mutable_start_from_this() = to_wire(step.T_start_this);
    *message.mutable_covariance() = to_wire(step.covariance);
  }
  if (!step.edge.valid()) return message;
  *message.mutable_edge() = to_wire(step.edge);
  message.set_kind(to_wire(step.kind));
  *message.mutable_to_next() = to_wire(step.T_to_next);
  message.set_long_loop(step.long_loop);
  return message;
}

// Where a stream broke: its ends, by which the same view and the same request give the same route again, and its next
// step.
struct Position {
  FrameId from, to;
  std::size_t step = 0;
  std::uint32_t fingerprint = 0;  // of the request

  std::string to_string() const {
    return from.to_string() + "," + to.to_string() + "," + std::to_string(step) + "," + std::to_string(fingerprint);
  }
  static std::optional<Position> parse(const std::string& text) {
    std::istringstream fields(text);
    std::string from, to, step, fingerprint;
    std::getline(fields, from, ',');
    std::getline(fields, to, ',');
    std::getline(fields, step, ',');
    std::getline(fields, fingerprint);
    const auto from_id = FrameId::parse(from), to_id = FrameId::parse(to);
    Position position;
    const auto read = [](const std::string& digits, auto& number) {
      const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
      return error == std::errc{} && end == digits.data() + digits.size();
    };
    if (!from_id || !to_id || !read(step, position.step) || !read(fingerprint, position.fingerprint))
      return std::nullopt;
    position.from = *from_id;
    position.to = *to_id;
    return position;
  }
};

// Reads the steps from the view as the caller takes them.
class RouteStream {
 public:
  RouteStream(Core& core, std::shared_ptr<const MapView> view, Route route, const v1::FindRouteRequest& request,
              const Deadline& deadline)
      : core_(core),
        view_(std::move(view)),
        route_(std::move(route)),
        deadline_(deadline),
        charge_(core.mapper.budget(), Share::kReplies),
        covariance_(request.covariance()),
        fingerprint_(route_fingerprint(request)),
        walk_(*view_, route_, covariance_) {}

  FrameId first() const { return route_.path.from; }
  FrameId last() const { return route_.path.to; }

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
    const std::size_t most = covariance_ ? kStepsWithCovariancePerMessage : kStepsPerMessage;
    while (static_cast<std::size_t>(reply.steps_size()) < most && label_bytes < kMaxLabelBytes) {
      const auto step = walk_.next();
      if (!step) break;
      for (const std::string& label : step->labels) label_bytes += label.size() + 2;
      *reply.add_steps() = step_message(*step, covariance_);
      ++next_;
    }
    if (next_ < route_.steps())
      reply.set_resume_token(
          core_.views.token(view_, Position{route_.path.from, route_.path.to, next_, fingerprint_}.to_string()));
    return std::optional(std::move(reply));
  }

  std::optional<v1::LocaliseReply> from_view, to_view;

 private:
  v1::RouteSummary summary() const {
    v1::RouteSummary message;
    *message.mutable_from() = to_wire(route_.path.from);
    *message.mutable_to() = to_wire(route_.path.to);
    message.set_cost(route_.cost);
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
  const bool covariance_;
  const std::uint32_t fingerprint_;
  RouteWalk walk_;
  std::size_t next_ = 0;
  bool summarised_ = false;
};

}  // namespace

bool needs_picture(const v1::FindRouteRequest& request) {
  const auto shows_one = [](const v1::RouteEnd& end) { return end.view().has_left(); };
  return shows_one(request.from()) || shows_one(request.to()) ||
         std::any_of(request.or_from().begin(), request.or_from().end(), shows_one) ||
         std::any_of(request.or_to().begin(), request.or_to().end(), shows_one);
}

Result<Producer<v1::FindRouteReply>> find_route(Core& core, const v1::FindRouteRequest& request,
                                                const Deadline& deadline) {
  auto opened = core.views.open(request.resume_token(), core.mapper.view());
  if (!opened.ok()) return opened.status();
  const MapView& view = *opened->view;
  const auto options = route_options(view, request, deadline);
  if (!options.ok()) return options.status();

  RouteEnds from, to;
  std::size_t first_step = 0;
  if (!opened->position.empty()) {
    const auto position = Position::parse(opened->position);
    if (!position) return {Reason::INVALID_ARGUMENT, "the resume token is not one of a route"};
    if (position->fingerprint != route_fingerprint(request))
      return {Reason::INVALID_ARGUMENT, "the resume token is of a request for another route"};
    from.frames = {position->from};
    to.frames = {position->to};
    first_step = position->step;
  } else {
    auto start = route_ends(core, view, request.from(), request.or_from(), "from", deadline);
    if (!start.ok()) return start.status();
    auto goal = route_ends(core, view, request.to(), request.or_to(), "to", deadline);
    if (!goal.ok()) return goal.status();
    from = std::move(start).value();
    to = std::move(goal).value();
  }

  SearchWork work(core, deadline);
  auto route = find_route(view, from.frames, to.frames, *options, work.limit());
  if (!route.ok()) return route.status();
  if (first_step >= route->steps()) return {Reason::INVALID_ARGUMENT, "the resume token is not one of this route"};
  const auto stream = std::make_shared<RouteStream>(core, opened->view, std::move(route).value(), request, deadline);
  stream->from_view = from.view_at(stream->first());
  stream->to_view = to.view_at(stream->last());
  if (Status status = stream->charge(); !status.ok()) return status;
  if (Status status = stream->skip(first_step); !status.ok()) return status;
  return Producer<v1::FindRouteReply>([stream] { return stream->take(); });
}

}  // namespace relmap
