#include <algorithm>
#include <charconv>
#include <set>

#include "proto/wire/convert.h"
#include "server/map/label_words.h"
#include "server/route/edge_list.h"
#include "server/rpc/charge.h"
#include "server/rpc/handlers.h"
#include "server/rpc/messages.h"

namespace relmap::rpc {

namespace {

constexpr std::uint32_t kSessionsPerPage = 100, kMaxSessionsPerPage = 1000;
constexpr std::uint32_t kEdgesPerPage = 1000, kMaxEdgesPerPage = 5000;
constexpr std::uint32_t kLabelsPerPage = 1000, kMaxLabelsPerPage = 5000;
constexpr std::size_t kMaxPageBytes = 2u << 20;  // a page ends early beyond it

std::uint32_t page_size(std::uint32_t asked, std::uint32_t usual, std::uint32_t max) {
  return asked == 0 ? usual : std::min(asked, max);
}

const Status kForeignToken(Reason::INVALID_ARGUMENT, "the page token is not one of this list");

}  // namespace

Result<v1::ListSessionsReply> list_sessions(const v1::ListSessionsRequest& request, const Deadline&,
                                            map::Mapper& mapper, ViewKeeper& views) {
  const auto opened = views.open(request.page_token(), mapper.view());
  if (!opened.ok()) return opened.status();
  SessionNumber after = 0;
  const std::string& position = opened->position;
  if (!position.empty() && std::from_chars(position.data(), position.data() + position.size(), after).ec != std::errc{})
    return kForeignToken;

  const std::uint32_t max_sessions = page_size(request.page_size(), kSessionsPerPage, kMaxSessionsPerPage);
  v1::ListSessionsReply reply;
  reply.set_map_version(opened->kept->version());
  bool more = false;
  opened->kept->visit_sessions(after + 1, [&](const storage::Session& session) {
    if (storage::is_deleted(session)) return true;
    more = static_cast<std::uint32_t>(reply.sessions_size()) == max_sessions;
    if (!more) *reply.add_sessions() = session_message(session);
    return !more;
  });
  if (more)
    reply.set_next_page_token(
        views.token(opened->kept, std::to_string(reply.sessions(reply.sessions_size() - 1).number())));
  return reply;
}

Result<v1::ListEdgesReply> list_edges(const v1::ListEdgesRequest& request, const Deadline& deadline,
                                      map::Mapper& mapper, ViewKeeper& views, const RpcLimits& limits) {
  const auto opened = views.open(request.page_token(), mapper.view());
  if (!opened.ok()) return opened.status();
  const storage::MapView& view = *opened->kept;
  route::EdgeFilter filter;
  for (const int state : request.states()) {
    const auto known = from_wire(static_cast<v1::EdgeState>(state));
    if (!known.ok()) return known.status();
    filter.states.insert(*known);
  }
  for (const int kind : request.kinds()) {
    const auto known = from_wire(static_cast<v1::EdgeKind>(kind));
    if (!known.ok()) return known.status();
    filter.kinds.insert(*known);
  }
  if (request.session() != 0) {
    if (const auto session = storage::existing_session(view, request.session()); !session.ok()) return session.status();
    filter.session = request.session();
  }
  if (request.has_frame()) {
    const auto frame = existing_frame(view, true, request.frame(), "frame");
    if (!frame.ok()) return frame.status();
    filter.frame = *frame;
  }
  EdgeId after;
  if (!opened->position.empty()) {
    const auto id = EdgeId::parse(opened->position);
    if (!id || !storage::find_edge(view, *id)) return kForeignToken;
    after = *id;
  }

  const std::uint32_t max_edges = page_size(request.page_size(), kEdgesPerPage, kMaxEdgesPerPage);
  v1::ListEdgesReply reply;
  reply.set_map_version(view.version());
  std::size_t bytes = 0;
  bool more = false;
  SearchWork work(mapper.budget(), limits.max_search_frames, deadline);
  const Status status = route::for_each_edge(view, filter, after, work.limit(), [&](const storage::Edge& edge) {
    more = static_cast<std::uint32_t>(reply.edges_size()) == max_edges || bytes > kMaxPageBytes;
    if (more) return false;
    *reply.add_edges() = edge_message(view, edge);
    bytes += reply.edges(reply.edges_size() - 1).ByteSizeLong();
    after = edge.id;
    return true;
  });
  if (!status.ok()) return status;
  if (more) reply.set_next_page_token(views.token(opened->kept, after.to_string()));
  return reply;
}

Result<v1::FindLabelsReply> find_labels(const v1::FindLabelsRequest& request, const Deadline& deadline,
                                        map::Mapper& mapper, ViewKeeper& views) {
  const auto opened = views.open(request.page_token(), mapper.view());
  if (!opened.ok()) return opened.status();
  const std::string& after = opened->position;
  const std::uint32_t max_labels = page_size(request.page_size(), kLabelsPerPage, kMaxLabelsPerPage);
  v1::FindLabelsReply reply;
  reply.set_map_version(opened->kept->version());
  std::size_t bytes = 0;
  for (const std::string& label : opened->kept->labels("")) {
    if (Status status = deadline.check(); !status.ok()) return status;
    if ((!after.empty() && label <= after) || !map::begins_with(label, request.prefix()) ||
        !map::has_words(label, request.words()))
      continue;
    if (static_cast<std::uint32_t>(reply.labels_size()) == max_labels || bytes > kMaxPageBytes) {
      reply.set_next_page_token(views.token(opened->kept, reply.labels(reply.labels_size() - 1).label()));
      break;
    }
    v1::LabelledFrames& added = *reply.add_labels();
    added.set_label(label);
    for (const FrameId frame : opened->kept->labelled(label)) *added.add_frames() = to_wire(frame);
    bytes += added.ByteSizeLong();
  }
  return reply;
}

}  // namespace relmap::rpc
