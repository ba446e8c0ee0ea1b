#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/base/read_number.h"
#include "proto/wire/convert.h"
#include "relmap/v1/evidence.pb.h"
#include "server/map/closure_list.h"
#include "server/route/neighbourhood.h"
#include "server/rpc/charge.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"
#include "server/rpc/pages.h"

namespace relmap::rpc {

namespace {

constexpr std::uint32_t kEdgesPerPage = 1000, kMaxEdgesPerPage = 5000;
constexpr std::size_t kMaxRegionFrames = 100'000;

Result<storage::FrameSet> frames_of_region(const storage::MapView& view, const v1::Region& region,
                                           const route::WorkLimit& work) {
  const auto root = existing_frame(view, region.has_root(), region.root(), "region.root");
  if (!root.ok()) return root.status();
  if (!std::isfinite(region.max_metres()) || region.max_metres() < 0)
    return {Reason::INVALID_ARGUMENT, "region.max_metres must be 0 (no limit) or more"};
  route::NeighbourhoodLimits limits;
  if (region.max_edges() > 0) limits.edges = region.max_edges();
  if (region.max_metres() > 0) limits.metres = region.max_metres();
  route::WorkLimit most = work;
  most.max_frames = std::min(most.max_frames, kMaxRegionFrames);
  const auto found = route::neighbourhood(view, *root, limits, most);
  if (!found.ok()) return found.status();
  if (found->cut)
    return {Reason::INVALID_ARGUMENT, "the region has more than " + std::to_string(most.max_frames) +
                                          " frames; a smaller max_edges or max_metres is needed"};
  storage::FrameSet frames;
  for (const route::NeighbourhoodFrame& member : found->frames) frames.insert(member.frame);
  return frames;
}

Result<map::EdgeChoice> choice_of(const storage::MapView& view, const v1::ListEdgesRequest& request,
                                  const route::WorkLimit& work) {
  map::EdgeChoice choice;
  for (const int state : request.states()) {
    const auto known = from_wire(static_cast<v1::EdgeState>(state));
    if (!known.ok()) return known.status();
    choice.filter.states.insert(*known);
  }
  for (const int kind : request.kinds()) {
    const auto known = from_wire(static_cast<v1::EdgeKind>(kind));
    if (!known.ok()) return known.status();
    choice.filter.kinds.insert(*known);
  }
  for (const auto& [number, chosen] :
       {std::pair(request.session(), &choice.filter.session), {request.other_session(), &choice.filter.other_session}})
    if (number != 0) {
      if (const auto session = storage::existing_session(view, number); !session.ok()) return session.status();
      *chosen = number;
    }
  if (request.other_session() != 0 && request.session() == 0)
    return {Reason::INVALID_ARGUMENT, "other_session needs session, too"};
  if (request.has_frame()) {
    const auto frame = existing_frame(view, true, request.frame(), "frame");
    if (!frame.ok()) return frame.status();
    choice.filter.frame = *frame;
  }
  if (request.from_us() < 0 || request.until_us() < 0 ||
      (request.until_us() != 0 && request.until_us() <= request.from_us()))
    return {Reason::INVALID_ARGUMENT, "the times must be 0 or more, and until_us later than from_us"};
  choice.from_us = request.from_us();
  choice.until_us = request.until_us();
  if (!(request.min_suspicion() >= 0 && request.min_suspicion() <= 1))
    return {Reason::INVALID_ARGUMENT, "min_suspicion must be between 0 and 1"};
  choice.min_suspicion = request.min_suspicion();
  if (request.has_region()) {
    auto frames = frames_of_region(view, request.region(), work);
    if (!frames.ok()) return frames.status();
    choice.region = std::move(frames).value();
  }
  return choice;
}

// Nullopt: by id.
Result<std::optional<map::ClosureOrder>> order_of(v1::EdgeOrder order) {
  switch (order) {
    case v1::EDGE_ORDER_UNSPECIFIED:
    case v1::EDGE_ORDER_ID:
      return std::optional<map::ClosureOrder>();
    case v1::EDGE_ORDER_SUSPICION:
      return std::optional(map::ClosureOrder::kSuspicion);
    case v1::EDGE_ORDER_TIME:
      return std::optional(map::ClosureOrder::kTime);
    default:
      return {Reason::INVALID_ARGUMENT, "unknown order of edges: " + std::to_string(order)};
  }
}

// Where a page in an order begins: "s" or "t", the bits of the suspicion or of the time, and the id of the closure
// before.
std::string position_of(map::ClosureOrder order, const map::ListedClosure& last) {
  const bool by_time = order == map::ClosureOrder::kTime;
  const std::uint64_t bits =
      by_time ? static_cast<std::uint64_t>(last.time_us) : std::bit_cast<std::uint64_t>(last.suspicion);
  return (by_time ? "t" : "s") + std::to_string(bits) + "," + last.id.to_string();
}
std::optional<map::ListedClosure> closure_at(map::ClosureOrder order, const std::string& position) {
  const bool by_time = order == map::ClosureOrder::kTime;
  const std::size_t comma = position.find(',');
  if (comma == std::string::npos || position[0] != (by_time ? 't' : 's')) return std::nullopt;
  map::ListedClosure last;
  const auto id = EdgeId::parse(position.substr(comma + 1));
  if (!id) return std::nullopt;
  last.id = *id;
  std::uint64_t bits = 0;
  if (!read_number(std::string_view(position).substr(1, comma - 1), bits)) return std::nullopt;
  if (by_time)
    last.time_us = static_cast<std::int64_t>(bits);
  else
    last.suspicion = std::bit_cast<double>(bits);
  return std::isnan(last.suspicion) ? std::nullopt : std::optional(last);
}

// A page that is being filled.
class EdgePage {
 public:
  EdgePage(v1::ListEdgesReply& reply, std::uint32_t max_edges) : reply_(reply), max_edges_(max_edges) {}

  bool is_full() const {
    return static_cast<std::uint32_t>(reply_.edges_size()) >= max_edges_ || bytes_ > kMaxPageBytes;
  }
  void add(const storage::Edge& edge, std::int64_t time_us) {
    *reply_.add_edges() = edge_message(edge, time_us);
    bytes_ += reply_.edges(reply_.edges_size() - 1).ByteSizeLong();
  }

 private:
  v1::ListEdgesReply& reply_;
  const std::uint32_t max_edges_;
  std::size_t bytes_ = 0;
};

// Whether digests tell sooner which frames have such edges than the frames themselves.
bool is_by_digests(const map::EdgeChoice& choice) {
  const bool closures_only = !choice.filter.kinds.empty() &&
                             !choice.filter.kinds.contains(storage::EdgeKind::kOdometry) &&
                             !choice.filter.kinds.contains(storage::EdgeKind::kPrior);
  const bool not_in_force =
      !choice.filter.states.empty() && !choice.filter.states.contains(storage::EdgeState::kAccepted);
  return choice.filter.other_session || choice.from_us != 0 || choice.until_us != 0 || choice.min_suspicion > 0 ||
         (!choice.filter.session && (closures_only || not_in_force));
}

// Fills a page with edges by id. Returns the position of the next page; empty: there is none.
Result<std::string> list_by_id(const storage::MapView& view, const map::EdgeChoice& choice, const std::string& position,
                               const route::WorkLimit& work, const map::Proceed& proceed, EdgePage& page) {
  EdgeId after;
  if (!position.empty()) {
    const auto id = EdgeId::parse(position);
    if (!id || !storage::find_edge(view, *id)) return foreign_token();
    after = *id;
  }
  bool more = false;
  const auto add = [&](const storage::Edge& edge, std::int64_t time_us) {
    more = page.is_full();
    if (more) return false;
    page.add(edge, time_us);
    after = edge.id;
    return true;
  };
  const bool by_choice = choice.region || (!choice.filter.frame && is_by_digests(choice));
  const Status status = by_choice
                            ? map::visit_edges(view, choice, after, proceed, add)
                            : route::for_each_edge(view, choice.filter, after, work, [&](const storage::Edge& edge) {
                                const auto hot = view.hot(edge.b);
                                const std::int64_t time_us = hot ? hot->time_us : 0;
                                return !choice.has(edge, time_us) || add(edge, time_us);
                              });
  if (!status.ok()) return status;
  return more ? after.to_string() : std::string();
}

// The same with closures in an order. Of the map only the digests are read, and the frames of the page.
Result<std::string> list_in_order(const storage::MapView& view, const map::EdgeChoice& choice, map::ClosureOrder order,
                                  const std::string& position, std::uint32_t max_edges, const map::Proceed& proceed,
                                  EdgePage& page) {
  std::optional<map::ListedClosure> after;
  if (!position.empty()) {
    after = closure_at(order, position);
    if (!after) return foreign_token();
  }
  const auto first = map::first_closures(view, choice, order, after, std::size_t{max_edges} + 1, proceed);
  if (!first.ok()) return first.status();
  for (std::size_t i = 0; i < first->size(); ++i) {
    if (page.is_full()) return position_of(order, (*first)[i - 1]);
    const map::ListedClosure& listed = (*first)[i];
    const auto edge = storage::find_edge(view, listed.id);
    if (!edge) return {Reason::DATA_LOSS, "edge " + listed.id.to_string() + " is missing, of which there is a digest"};
    page.add(*edge, listed.time_us);
  }
  return std::string();
}

}  // namespace

Result<v1::ListEdgesReply> list_edges(const v1::ListEdgesRequest& request, const Deadline& deadline,
                                      map::Mapper& mapper, ViewKeeper& views, const RpcLimits& limits) {
  const auto opened = views.open(request.page_token(), mapper.view());
  if (!opened.ok()) return opened.status();
  const storage::MapView& view = *opened->kept;
  const auto order = order_of(request.order());
  if (!order.ok()) return order.status();
  SearchWork work(mapper.budget(), limits.max_search_frames, deadline);
  const auto choice = choice_of(view, request, work.limit());
  if (!choice.ok()) return choice.status();

  const std::uint32_t max_edges = page_size(request.page_size(), kEdgesPerPage, kMaxEdgesPerPage);
  v1::ListEdgesReply reply;
  reply.set_map_version(view.version());
  EdgePage page(reply, max_edges);
  const auto proceed = [&] { return deadline.check(); };
  const auto next = *order ? list_in_order(view, *choice, **order, opened->position, max_edges, proceed, page)
                           : list_by_id(view, *choice, opened->position, work.limit(), proceed, page);
  if (!next.ok()) return next.status();
  if (!next->empty()) reply.set_next_page_token(views.token(opened->kept, *next));
  return reply;
}

}  // namespace relmap::rpc
