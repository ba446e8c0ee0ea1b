#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "proto/base/read_number.h"
#include "proto/wire/convert.h"
#include "server/route/overlay/route_search.h"
#include "server/rpc/charge.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/route_request.h"

namespace relmap::rpc {

namespace {

// A step has about 200 bytes without labels, and 450 with its covariance.
constexpr std::size_t kStepsWithCovariancePerMessage = 400;
constexpr std::size_t kMaxLabelBytes = kUsualStreamMessageBytes / 4;

v1::RouteStep step_message(const route::RouteStep& step, bool covariance) {
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
  message.set_carried(step.carried);
  message.set_unmeasured(step.unmeasured);
  return message;
}

// The route and the step at which a stream broke, and the fingerprint of its request.
struct RoutePosition {
  std::size_t route = 0, step = 0;
  std::uint32_t fingerprint = 0;

  std::string to_string() const {
    return std::to_string(route) + "," + std::to_string(step) + "," + std::to_string(fingerprint);
  }
  static std::optional<RoutePosition> parse(const std::string& text) {
    RoutePosition position;
    const std::string_view numbers = text;
    const std::size_t first = numbers.find(',');
    const std::size_t second = first == std::string_view::npos ? first : numbers.find(',', first + 1);
    if (second == std::string_view::npos || !read_number(numbers.substr(0, first), position.route) ||
        !read_number(numbers.substr(first + 1, second - first - 1), position.step) ||
        !read_number(numbers.substr(second + 1), position.fingerprint))
      return std::nullopt;
    return position;
  }
};

// Charges the memory of a route; drops the least recently used ones to make room.
Status charge_for(TokenKeeper<FoundRoute>& others, FoundRoute& found) {
  for (;;) {
    Status charged = found.charge.grow_to(found.memory_bytes() + found.from->memory_bytes() + found.to->memory_bytes());
    if (charged.ok() || !others.drop_oldest()) return charged;
  }
}

// Streams a route, then its alternatives; the steps are read from the view as the caller takes them.
class RouteStream {
 public:
  RouteStream(Routes& routes, const RpcLimits& limits, std::shared_ptr<const FoundRoute> found, bool covariance,
              const Deadline& deadline)
      : routes_(routes),
        found_(std::move(found)),
        deadline_(deadline),
        covariance_(covariance),
        steps_per_message_(covariance ? std::min(limits.route_steps_per_message, kStepsWithCovariancePerMessage)
                                      : limits.route_steps_per_message) {
    begin(0);
  }

  // Skips what an earlier stream has sent: all before this step, which is not the first, of this route.
  Status skip(std::size_t route, std::size_t steps) {
    begin(route);
    summarised_ = true;
    for (; next_ < steps; ++next_) {
      if (next_ % route::kWorkStride == 0)
        if (Status status = deadline_.check(); !status.ok()) return status;
      walk_->next();
    }
    return {};
  }

  Result<std::optional<v1::FindRouteReply>> take() {
    if (summarised_ && next_ >= route().steps()) {
      if (number_ + 1 == found_->routes()) {
        routes_.found.end(found_->number);  // with its view, which holds memory for as long as the route is kept
        return std::optional<v1::FindRouteReply>();
      }
      begin(number_ + 1);
    }
    v1::FindRouteReply reply;
    reply.set_route(static_cast<std::uint32_t>(number_));
    if (!summarised_) *reply.mutable_summary() = summary();
    summarised_ = true;
    std::size_t label_bytes = 0;
    while (static_cast<std::size_t>(reply.steps_size()) < steps_per_message_ && label_bytes < kMaxLabelBytes) {
      const auto step = walk_->next();
      if (!step) break;
      for (const std::string& label : step->labels) label_bytes += label.size() + 2;
      *reply.add_steps() = step_message(*step, covariance_);
      ++next_;
    }
    if (next_ < route().steps() || number_ + 1 < found_->routes())
      reply.set_resume_token(
          routes_.found.token(found_->number, found_, RoutePosition{number_, next_, found_->fingerprint}.to_string()));
    return std::optional(std::move(reply));
  }

 private:
  const route::Route& route() const { return found_->route(number_); }
  void begin(std::size_t number) {
    number_ = number;
    next_ = 0;
    summarised_ = false;
    walk_.emplace(*found_->view, route(), covariance_);
  }

  v1::RouteSummary summary() const {
    const route::Route& route = this->route();
    v1::RouteSummary message;
    *message.mutable_from() = to_wire(route.path.from);
    *message.mutable_to() = to_wire(route.path.to);
    message.set_cost(route.cost);
    message.set_distance_m(route.distance_m);
    message.set_time_s(route.time_s);
    message.set_steps(static_cast<std::uint32_t>(route.steps()));
    message.set_long_loops(route.long_loops);
    for (const route::CarriedStretch& stretch : route.carried.list()) *message.add_carried() = carried_message(stretch);
    tell_unmeasured(route.unmeasured, message);
    message.set_frames_touched(route.frames_touched);
    message.set_map_version(found_->view->version());
    message.set_frame_by_frame(found_->answer.frame_by_frame);
    message.set_bound_closures(found_->answer.near || !found_->answer.frame_by_frame.empty());
    message.set_no_way_by_edges(found_->answer.no_way_by_edges);
    if (number_ > 0) message.set_shared(found_->alternatives[number_ - 1].shared);
    if (const auto* view = found_->from->at(route.path.from)) *message.mutable_from_view() = *view;
    if (const auto* view = found_->to->at(route.path.to)) *message.mutable_to_view() = *view;
    return message;
  }

  Routes& routes_;
  const std::shared_ptr<const FoundRoute> found_;
  const Deadline& deadline_;
  const bool covariance_;
  const std::size_t steps_per_message_;
  std::size_t number_ = 0;  // of the route that is being sent
  std::optional<route::RouteWalk> walk_;
  std::size_t next_ = 0;
  bool summarised_ = false;
};

Result<Producer<v1::FindRouteReply>> resume(Routes& routes, const RpcLimits& limits,
                                            const v1::FindRouteRequest& request, const Deadline& deadline) {
  const auto opened = routes.found.open(request.resume_token());
  if (!opened.ok()) return opened.status();
  const auto position = RoutePosition::parse(opened->position);
  const auto is_sent_then = [&] {
    const FoundRoute& found = *opened->kept;
    if (position->route >= found.routes() || position->step == 0) return false;
    const std::size_t steps = found.route(position->route).steps();
    return position->step < steps || (position->step == steps && position->route + 1 < found.routes());
  };
  if (!position || !is_sent_then()) return {Reason::INVALID_ARGUMENT, "the resume token is not one of a route"};
  // The ends may be left out, since the route is known.
  const bool has_ends =
      request.has_from() || request.has_to() || !request.or_from().empty() || !request.or_to().empty();
  if (position->fingerprint != route_fingerprint(request) ||
      (has_ends && opened->kept->ends_fingerprint != route_ends_fingerprint(request)))
    return {Reason::INVALID_ARGUMENT, "the resume token is of a request for another route"};
  const auto stream = std::make_shared<RouteStream>(routes, limits, opened->kept, request.covariance(), deadline);
  if (Status status = stream->skip(position->route, position->step); !status.ok()) return status;
  return Producer<v1::FindRouteReply>([stream] { return stream->take(); });
}

// Searching for alternatives ends by half of the time that is left, so that what has been found can be told.
std::vector<route::Alternative> alternatives(const route::RouteIndex::Snapshot& map, const std::vector<FrameId>& from,
                                             const std::vector<FrameId>& to, const route::RouteOptions& options,
                                             const route::RouteAnswer& cheapest, std::uint32_t count,
                                             const Deadline& deadline, storage::Budget& budget,
                                             const RpcLimits& limits) {
  const auto now = std::chrono::steady_clock::now();
  Deadline earlier = deadline;
  if (deadline.at > now) earlier.at = now + (deadline.at - now) / 2;
  SearchWork work(budget, limits.max_search_frames, earlier);
  return route::search_alternatives(map, from, to, options, limits.near_route_steps, cheapest, count, work.limit());
}

}  // namespace

bool needs_picture(const v1::FindRouteRequest& request) {
  const auto shows_one = [](const v1::RouteEnd& end) { return end.view().has_left(); };
  return shows_one(request.from()) || shows_one(request.to()) ||
         std::any_of(request.or_from().begin(), request.or_from().end(), shows_one) ||
         std::any_of(request.or_to().begin(), request.or_to().end(), shows_one);
}

Result<Producer<v1::FindRouteReply>> find_route(const v1::FindRouteRequest& request, const Deadline& deadline,
                                                map::Mapper& mapper, Routes& routes, const RpcLimits& limits) {
  if (!request.resume_token().empty()) return resume(routes, limits, request, deadline);
  const route::RouteIndex::Snapshot map =
      routes.index ? routes.index->snapshot()
                   : route::RouteIndex::Snapshot{mapper.view(), nullptr, "there are none", {}, {}};
  const auto options = route_options(*map.view, request, deadline);
  if (!options.ok()) return options.status();
  auto from = route_ends(mapper, *map.view, request.from(), request.or_from(), "from", deadline);
  if (!from.ok()) return from.status();
  auto to = route_ends(mapper, *map.view, request.to(), request.or_to(), "to", deadline);
  if (!to.ok()) return to.status();

  auto found = std::make_shared<FoundRoute>(mapper.budget(), ++routes.searched);
  found->fingerprint = route_fingerprint(request);
  found->ends_fingerprint = route_ends_fingerprint(request);
  found->view = map.view;
  found->from = std::make_shared<const SeenEnds>(std::move(from->seen));
  found->to = std::make_shared<const SeenEnds>(std::move(to->seen));
  auto answer = [&] {
    SearchWork work(mapper.budget(), limits.max_search_frames,
                    deadline);  // releases its memory before that of the route is charged
    return route::search_route(map, from->frames, to->frames, *options, limits.near_route_steps, work.limit());
  }();
  if (!answer.ok()) return answer.status();
  found->answer = std::move(answer).value();
  if (request.alternatives() > 0) {
    found->alternatives = alternatives(map, from->frames, to->frames, *options, found->answer, request.alternatives(),
                                       deadline, mapper.budget(), limits);
    if (Status status = deadline.check(); !status.ok()) return status;
  }
  for (Status status = charge_for(routes.found, *found); !status.ok(); status = charge_for(routes.found, *found)) {
    if (found->alternatives.empty()) return status;
    found->alternatives.pop_back();
  }
  const auto stream = std::make_shared<RouteStream>(routes, limits, found, request.covariance(), deadline);
  return Producer<v1::FindRouteReply>([stream] { return stream->take(); });
}

}  // namespace relmap::rpc
