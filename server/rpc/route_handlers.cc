#include <algorithm>
#include <charconv>
#include <memory>

#include "proto/wire/convert.h"
#include "server/route/dijkstra.h"
#include "server/route/overlay/overlay_search.h"
#include "server/route/overlay/reachability.h"
#include "server/rpc/edge_effect.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/route_request.h"
#include "server/rpc/search_work.h"
#include "server/rpc/unmeasured_message.h"

namespace relmap {

namespace {

// A step has about 200 bytes without labels, and 450 with its covariance.
constexpr std::size_t kStepsWithCovariancePerMessage = 400;
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
  message.set_carried(step.carried);
  message.set_unmeasured(step.unmeasured);
  return message;
}

// The step at which a stream broke, and whose request it was.
struct Position {
  std::size_t step = 0;
  std::uint32_t fingerprint = 0;

  std::string to_string() const { return std::to_string(step) + "," + std::to_string(fingerprint); }
  static std::optional<Position> parse(const std::string& text) {
    const std::size_t comma = text.find(',');
    if (comma == std::string::npos) return std::nullopt;
    Position position;
    const auto read = [&](std::size_t begin, std::size_t end, auto& number) {
      const auto [rest, error] = std::from_chars(text.data() + begin, text.data() + end, number);
      return error == std::errc{} && rest == text.data() + end;
    };
    if (!read(0, comma, position.step) || !read(comma + 1, text.size(), position.fingerprint)) return std::nullopt;
    return position;
  }
};

bool too_stale(const RouteIndex::Snapshot& map) {
  return map.stale.size() > std::max<std::size_t>(100, map.overlay->tree().chunks() / 10);
}

// What is wanted, as cells have it; or why they have not.
Result<OverlayQuery> as_cells_have_it(const RouteIndex::Snapshot& map, const RouteOptions& options) {
  const auto without = [](std::string why) { return Status(Reason::UNSUPPORTED, std::move(why)); };
  if (!map.overlay) return without(map.missing_because);
  OverlayQuery query;
  const auto metrics = map.overlay->metrics();
  const auto metric = std::find(metrics.begin(), metrics.end(), options.weights);
  if (metric == metrics.end())
    return without("there are cells for " + std::to_string(metrics.size()) +
                   " kinds of cost, and this is none of them (routes.mixes of the configuration)");
  query.metric = static_cast<std::size_t>(metric - metrics.begin());
  if (too_stale(map))
    return without("more than a tenth of the map has changed, which the cells do not know yet" +
                   (map.late_because.empty() ? "" : ": " + map.late_because));
  query.stale = map.stale;
  auto opened = cells_to_open(*map.overlay, options.filter);
  if (!opened) return without("what is to be avoided, or supposed, lies in more than a tenth of the cells");
  query.opened = *std::move(opened);
  query.filter = options.filter;
  query.max_cost = options.max_cost;
  return query;
}

Result<Route> search_cells(const RouteIndex::Snapshot& map, const OverlayQuery& query, const RouteEnds& from,
                           const RouteEnds& to, bool count_standing, const WorkLimit& work) {
  auto route = find_route(*map.overlay, *map.view, query, from.frames, to.frames, work);
  if (!route.ok()) return route.status();
  if (Status status = unpack(*map.overlay, *map.view, query.metric, *route, work); !status.ok()) return status;
  return follow(*map.overlay, *map.view, query.metric, *route, count_standing, work);
}

// NOT_CONNECTED, if cells that are not those of the question say so nevertheless: filters only take edges away. The
// closures that only bind, which every question supposes besides, are followed around the start (with_bound()).
Status check_joined(const RouteIndex::Snapshot& map, const RouteEnds& from, const RouteEnds& to,
                    const RouteOptions& options, const WorkLimit& work) {
  if (!map.overlay || too_stale(map) || options.filter.supposed.candidates || options.filter.supposed.quarantined)
    return {};
  try {
    return check_joined(*map.overlay, *map.view, map.stale, from.frames, to.frames, work);
  } catch (const StatusError& error) {
    const Reason reason = error.status().reason();
    return reason == Reason::DEADLINE ? error.status() : Status();
  }
}

// Cells do not know of closures that only bind. Where what they found is short, or nothing, these are followed frame by
// frame around the start: a goal that is found so is found in the best of all ways.
Result<Route> with_bound(Result<Route> by_cells, const RouteIndex::Snapshot& map, const RouteEnds& from,
                         const RouteEnds& to, const RouteOptions& options, std::uint64_t near_steps, SearchWork& work,
                         FoundRoute& found) {
  const Reason reason = by_cells.reason();
  const bool refused = reason == Reason::NOT_CONNECTED || reason == Reason::COST_LIMIT;
  if (!(by_cells.ok() ? by_cells->steps() <= near_steps : refused)) return by_cells;
  Result<Route> near = Status(Reason::OUT_OF_REACH, "");
  try {
    near = find_route(*map.view, from.frames, to.frames, options, work.limit(kNearFramesAStep * near_steps));
  } catch (const StatusError&) {  // what cannot be read there may be none of the route's
  }
  found.near = near.ok();
  found.no_way_by_edges = near.ok() && !by_cells.ok();
  if (near.ok()) return near;
  if (by_cells.ok()) return by_cells;
  // A search that came to a limit of its own leaves what edges say as the answer.
  if (near.reason() != Reason::OUT_OF_REACH && near.reason() != Reason::BUDGET_EXCEEDED) return near;
  return Status(reason, by_cells.status().message() +
                            "; closures that only bind landmarks were followed near the start, and not beyond");
}

Status search(Core& core, const RouteIndex::Snapshot& map, const RouteEnds& from, const RouteEnds& to,
              const RouteOptions& options, const Deadline& deadline, FoundRoute& found) {
  SearchWork work(core, deadline);
  found.view = map.view;
  const Status unanswered(Reason::UNSUPPORTED, "");  // by cells
  Result<Route> route = unanswered;
  if (const auto query = as_cells_have_it(map, options); query.ok()) {
    try {
      route = search_cells(map, *query, from, to, options.count_standing, work.limit());
    } catch (const StatusError& error) {
      route = error.status();
    }
    // Of a chunk all frames are read: one that is damaged may be none of the route's; and cells need room of their own.
    if (const Reason reason = route.reason();
        reason == Reason::DATA_LOSS || reason == Reason::IO_ERROR || reason == Reason::BUDGET_EXCEEDED) {
      found.frame_by_frame = route.status().message();
      route = unanswered;
    }
  } else {
    found.frame_by_frame = query.status().message();
    // Where edges do not join the ends Dijkstra would have to see all that is joined to the start.
    if (Status status = check_joined(map, from, to, options, work.limit()); !status.ok()) route = std::move(status);
  }
  route = route.reason() == unanswered.reason()
              ? find_route(*map.view, from.frames, to.frames, options, work.limit())
              : with_bound(std::move(route), map, from, to, options, core.limits.near_route_steps, work, found);
  if (!route.ok()) return route.status();
  found.route = std::move(route).value();
  return {};
}

// Routes whose streams nobody has resumed for the longest time make room.
Status charge_for(Core& core, FoundRoute& found) {
  for (;;) {
    Status charged = found.charge.grow_to(found.route.path.memory_bytes());
    if (charged.ok() || !core.found_routes.drop_oldest()) return charged;
  }
}

// Reads the steps from the view as the caller takes them.
class RouteStream {
 public:
  RouteStream(Core& core, std::shared_ptr<const FoundRoute> found, bool covariance, const Deadline& deadline)
      : core_(core),
        found_(std::move(found)),
        route_(found_->route),
        deadline_(deadline),
        covariance_(covariance),
        steps_per_message_(covariance ? std::min(core.limits.route_steps_per_message, kStepsWithCovariancePerMessage)
                                      : core.limits.route_steps_per_message),
        walk_(*found_->view, route_, covariance_) {}

  // The summary, and steps that an earlier stream has brought.
  Status skip(std::size_t steps) {
    summarised_ = true;
    for (; next_ < steps; ++next_) {
      if (next_ % kWorkStride == 0)
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
    while (static_cast<std::size_t>(reply.steps_size()) < steps_per_message_ && label_bytes < kMaxLabelBytes) {
      const auto step = walk_.next();
      if (!step) break;
      for (const std::string& label : step->labels) label_bytes += label.size() + 2;
      *reply.add_steps() = step_message(*step, covariance_);
      ++next_;
    }
    if (next_ < route_.steps())
      reply.set_resume_token(
          core_.found_routes.token(found_->number, found_, Position{next_, found_->fingerprint}.to_string()));
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
    for (const CarriedStretch& stretch : route_.carried.list()) *message.add_carried() = carried_message(stretch);
    tell_unmeasured(route_.unmeasured, message);
    message.set_frames_touched(route_.frames_touched);
    message.set_map_version(found_->view->version());
    message.set_frame_by_frame(found_->frame_by_frame);
    message.set_bound_closures(found_->near || !found_->frame_by_frame.empty());
    message.set_no_way_by_edges(found_->no_way_by_edges);
    if (from_view) *message.mutable_from_view() = *from_view;
    if (to_view) *message.mutable_to_view() = *to_view;
    return message;
  }

  Core& core_;
  const std::shared_ptr<const FoundRoute> found_;
  const Route& route_;
  const Deadline& deadline_;
  const bool covariance_;
  const std::size_t steps_per_message_;
  RouteWalk walk_;
  std::size_t next_ = 0;
  bool summarised_ = false;
};

Result<Producer<v1::FindRouteReply>> resume(Core& core, const v1::FindRouteRequest& request, const Deadline& deadline) {
  const auto opened = core.found_routes.open(request.resume_token());
  if (!opened.ok()) return opened.status();
  const auto position = Position::parse(opened->position);
  if (!position || position->step == 0 || position->step >= opened->kept->route.steps())
    return {Reason::INVALID_ARGUMENT, "the resume token is not one of a route"};
  // The ends may be left out: the route is known.
  const bool has_ends =
      request.has_from() || request.has_to() || !request.or_from().empty() || !request.or_to().empty();
  if (position->fingerprint != route_fingerprint(request) ||
      (has_ends && opened->kept->ends_fingerprint != route_ends_fingerprint(request)))
    return {Reason::INVALID_ARGUMENT, "the resume token is of a request for another route"};
  const auto stream = std::make_shared<RouteStream>(core, opened->kept, request.covariance(), deadline);
  if (Status status = stream->skip(position->step); !status.ok()) return status;
  return Producer<v1::FindRouteReply>([stream] { return stream->take(); });
}

}  // namespace

bool needs_picture(const v1::FindRouteRequest& request) {
  const auto shows_one = [](const v1::RouteEnd& end) { return end.view().has_left(); };
  return shows_one(request.from()) || shows_one(request.to()) ||
         std::any_of(request.or_from().begin(), request.or_from().end(), shows_one) ||
         std::any_of(request.or_to().begin(), request.or_to().end(), shows_one);
}

Result<Producer<v1::FindRouteReply>> find_route(Core& core, const v1::FindRouteRequest& request,
                                                const Deadline& deadline) {
  if (!request.resume_token().empty()) return resume(core, request, deadline);
  const RouteIndex::Snapshot map = core.routes
                                       ? core.routes->snapshot()
                                       : RouteIndex::Snapshot{core.mapper.view(), nullptr, "there are none", {}, {}};
  const auto options = route_options(*map.view, request, deadline);
  if (!options.ok()) return options.status();
  const auto from = route_ends(core, *map.view, request.from(), request.or_from(), "from", deadline);
  if (!from.ok()) return from.status();
  const auto to = route_ends(core, *map.view, request.to(), request.or_to(), "to", deadline);
  if (!to.ok()) return to.status();

  auto found = std::make_shared<FoundRoute>(core.mapper.budget(), ++core.routes_searched);
  found->fingerprint = route_fingerprint(request);
  found->ends_fingerprint = route_ends_fingerprint(request);
  if (Status status = search(core, map, *from, *to, *options, deadline, *found); !status.ok()) return status;
  if (Status status = charge_for(core, *found); !status.ok()) return status;
  const auto stream = std::make_shared<RouteStream>(core, found, request.covariance(), deadline);
  stream->from_view = from->view_at(found->route.path.from);
  stream->to_view = to->view_at(found->route.path.to);
  return Producer<v1::FindRouteReply>([stream] { return stream->take(); });
}

}  // namespace relmap
