#include "client/relmap_client.h"

#include <algorithm>
#include <cstdlib>
#include <thread>
#include <utility>

#include "client/channel.h"
#include "client/client_impl.h"
#include "client/replies.h"
#include "client/server_address.h"
#include "proto/base/utf8.h"
#include "proto/wire/convert.h"

namespace relmap::client {

namespace {

using MapStub = v1::Map::Stub;

// Why there is no connection, as gRPC puts it; empty if it does not know yet.
std::string why_not(v1::Map::Stub& map) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(500));
  v1::GetStatusReply reply;
  const grpc::Status status = map.GetStatus(&context, {}, &reply);
  constexpr char kLast[] = "last error: ";
  const std::string& text = status.error_message();
  const std::size_t at = text.find(kLast);
  return status.error_code() != grpc::StatusCode::UNAVAILABLE || at == std::string::npos
             ? ""
             : ": " + text.substr(at + sizeof kLast - 1);
}

// Waits for the connection, but no longer once `stop` says so.
bool is_connected_by(std::chrono::system_clock::time_point until, grpc::Channel& channel, const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kLook{100};
  for (;;) {
    const auto now = std::chrono::system_clock::now();
    if (channel.WaitForConnected(std::min(until, now + kLook))) return true;
    if (now + kLook >= until || stop.stop_requested()) return false;
  }
}

// gRPC would end the process over a header that is none.
Status check_names(const ClientOptions& options) {
  for (const auto& [text, what] :
       {std::pair(&options.request_id, "name of a request"), std::pair(&options.traceparent, "traceparent")})
    if (!std::all_of(text->begin(), text->end(), [](char c) { return c > ' ' && c <= '~'; }))
      return {Reason::INVALID_ARGUMENT, "'" + *text + "' is no " + what};
  return {};
}

// After a kill another daemon serves the folder before its file `endpoint` says so.
constexpr std::chrono::milliseconds kFileIsWrittenWithin{1000};

}  // namespace

ClientOptions ClientOptions::from_environment() {
  ClientOptions options;
  if (const char* const id = std::getenv("RELMAP_REQUEST_ID")) options.request_id = id;
  if (const char* const parent = std::getenv("TRACEPARENT")) options.traceparent = parent;
  return options;
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Client::~Client() = default;

Result<std::unique_ptr<Client>> Client::connect(const std::string& server, ClientOptions options) {
  const auto where = resolve_server(server);
  if (!where.ok()) return where.status();
  if (Status names = check_names(options); !names.ok()) return names;
  const Impl::Clock::time_point until = Impl::Clock::now() + options.connect_timeout;
  auto channel =
      options.authorities.empty()
          ? open_channel(*where, options.credentials, usual_channel_arguments())
          : Result(open_channel_for_tokens(*where, options.authorities, usual_channel_arguments(), options.token));
  if (!channel.ok()) return channel.status();
  auto impl = std::make_unique<Impl>(server, std::move(*channel), std::move(options));
  const std::string named = where->pid ? " (written by process " + std::to_string(where->pid) + ")" : "";
  if (!is_connected_by(until, *impl->channel, impl->options.stop)) {
    if (impl->options.stop.stop_requested()) return Impl::stopped();
    const std::string why = why_not(*impl->map);
    return {Reason::UNREACHABLE, "nothing answers at " + where->address + named +
                                     other_causes(*where, impl->options.credentials, why) + why};
  }
  if (where->boot_id.empty()) return std::unique_ptr<Client>(new Client(std::move(impl)));

  // After a crash the file `endpoint` remains, and another daemon may use its port by now.
  grpc::ClientContext context;
  const auto cancelled = impl->begin(context, until);
  v1::GetStatusReply reply;
  if (Status status = impl->end_of(impl->map->GetStatus(&context, {}, &reply)); !status.ok()) return status;
  if (reply.boot_id() == where->boot_id) return std::unique_ptr<Client>(new Client(std::move(impl)));
  // A daemon that has just started in its place writes the file anew.
  for (const auto enough = std::min(until, Impl::Clock::now() + kFileIsWrittenWithin);;) {
    const auto now = resolve_server(server);
    if (now.ok() && now->boot_id != where->boot_id) {
      ClientOptions again = impl->options;
      again.connect_timeout = std::chrono::duration_cast<std::chrono::milliseconds>(until - Impl::Clock::now());
      return connect(server, std::move(again));
    }
    if (Impl::Clock::now() >= enough || impl->options.stop.stop_requested()) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return {Reason::UNREACHABLE, "the daemon that served " + server + " is gone; another answers at " + where->address};
}

Result<std::unique_ptr<Client>> Client::connect_again() const { return connect(impl_->server, impl_->options); }

std::unique_ptr<Client> Client::with_deadline(std::chrono::milliseconds deadline) const {
  ClientOptions options = impl_->options;
  options.deadline = deadline;
  return std::unique_ptr<Client>(new Client(std::make_unique<Impl>(impl_->server, impl_->channel, std::move(options))));
}

Result<DaemonStatus> Client::status() {
  v1::GetStatusReply reply;
  if (Status status = impl_->ask_map(&MapStub::GetStatus, v1::GetStatusRequest(), reply); !status.ok()) return status;
  return read_status(reply);
}

Status Client::wait_idle() {
  v1::WaitIdleReply reply;
  return impl_->ask(*impl_->admin, &v1::Admin::Stub::WaitIdle, v1::WaitIdleRequest(), reply, impl_->deadline());
}

Result<Localisation> Client::localise(const View& view, std::optional<FrameId> prior, bool correspondences) {
  v1::LocaliseRequest request;
  request.set_correspondences(correspondences);
  *request.mutable_view() = view_message(view);
  if (prior) *request.mutable_prior() = to_wire(*prior);
  v1::LocaliseReply reply;
  if (Status status = impl_->ask_map(&MapStub::Localise, request, reply); !status.ok()) return status;
  return read_localisation(reply);
}

Result<PlaceMatches> Client::match_image(const View& view, const MatchOptions& options) {
  v1::MatchImageRequest request;
  *request.mutable_view() = view_message(view);
  request.set_max_places(options.max_places);
  request.set_max_verified(options.max_verified);
  request.set_thumbnails(options.thumbnails);
  request.set_correspondences(options.correspondences);
  if (options.near) *request.mutable_near() = to_wire(*options.near);
  v1::MatchImageReply reply;
  if (Status status = impl_->ask_map(&MapStub::MatchImage, request, reply); !status.ok()) return status;
  return read_matches(reply);
}

Result<Route> Client::find_route(const RouteRequest& asked) {
  Route route;
  const Status status = impl_->read_stream<v1::FindRouteReply>(
      &MapStub::FindRoute, route_message(asked),
      [&](const v1::FindRouteReply& reply) { return read_route_reply(reply, route); });
  if (!status.ok()) return status;
  return route;
}

Result<TransformBetween> Client::transform_between(FrameId a, FrameId b) {
  v1::TransformBetweenRequest request;
  *request.mutable_a() = to_wire(a);
  *request.mutable_b() = to_wire(b);
  v1::TransformBetweenReply reply;
  if (Status status = impl_->ask_map(&MapStub::TransformBetween, request, reply); !status.ok()) return status;
  return read_transform(reply);
}

Result<Frame> Client::frame(FrameId id, bool with_thumbnail, bool with_picture) {
  v1::GetFrameRequest request;
  *request.mutable_frame() = to_wire(id);
  request.set_thumbnail(with_thumbnail);
  request.set_picture(with_picture);
  v1::GetFrameReply reply;
  if (Status status = impl_->ask_map(&MapStub::GetFrame, request, reply); !status.ok()) return status;
  return read_frame(reply.frame());
}

Result<Neighbourhood> Client::neighbourhood(const Region& region, std::uint32_t max_frames) {
  v1::GetNeighbourhoodRequest request;
  *request.mutable_root() = to_wire(region.root);
  request.set_max_edges(region.max_edges);
  request.set_max_metres(region.max_metres);
  request.set_max_frames(max_frames);
  v1::GetNeighbourhoodReply reply;
  if (Status status = impl_->ask_map(&MapStub::GetNeighbourhood, request, reply); !status.ok()) return status;
  return read_neighbourhood(reply);
}

Result<std::vector<Session>> Client::sessions() {
  std::vector<Session> all;
  const Status status = impl_->list<v1::ListSessionsReply>(&MapStub::ListSessions, v1::ListSessionsRequest(),
                                                           [&](const v1::ListSessionsReply& page) -> Status {
                                                             for (const v1::Session& message : page.sessions()) {
                                                               auto session = read_session(message);
                                                               if (!session.ok()) return session.status();
                                                               all.push_back(std::move(session).value());
                                                             }
                                                             return {};
                                                           });
  if (!status.ok()) return status;
  return all;
}

Result<std::vector<RobotStatus>> Client::robots() {
  v1::ListRobotsReply reply;
  if (Status status = impl_->ask_map(&MapStub::ListRobots, v1::ListRobotsRequest(), reply); !status.ok()) return status;
  std::vector<RobotStatus> robots;
  for (const v1::Robot& message : reply.robots()) robots.push_back(read_robot(message));
  return robots;
}

Result<std::vector<Edge>> Client::edges(const EdgeFilter& filter) {
  std::vector<Edge> all;
  const Status status = impl_->list_until<v1::ListEdgesReply>(*impl_->map, &MapStub::ListEdges, edges_message(filter),
                                                              [&](const v1::ListEdgesReply& page) -> Result<bool> {
                                                                for (const v1::Edge& message : page.edges()) {
                                                                  if (filter.limit > 0 && all.size() == filter.limit)
                                                                    return false;
                                                                  auto edge = read_edge(message);
                                                                  if (!edge.ok()) return edge.status();
                                                                  all.push_back(std::move(edge).value());
                                                                }
                                                                return filter.limit == 0 || all.size() < filter.limit;
                                                              });
  if (!status.ok()) return status;
  return all;
}

Result<std::vector<ClosureMatrixCell>> Client::closure_matrix(const std::vector<SessionNumber>& sessions) {
  v1::GetClosureMatrixRequest request;
  for (const SessionNumber session : sessions) request.add_sessions(session);
  std::vector<ClosureMatrixCell> cells;
  const Status status = impl_->list<v1::GetClosureMatrixReply>(
      &MapStub::GetClosureMatrix, request, [&](const v1::GetClosureMatrixReply& page) -> Status {
        for (const v1::ClosureMatrixCell& message : page.cells()) cells.push_back(read_cell(message));
        return {};
      });
  if (!status.ok()) return status;
  return cells;
}

Result<EdgeExplanation> Client::explain_edge(EdgeId edge, bool with_pictures) {
  v1::ExplainEdgeRequest request;
  *request.mutable_edge() = to_wire(edge);
  request.set_pictures(with_pictures);
  v1::ExplainEdgeReply reply;
  if (Status status = impl_->ask_map(&MapStub::ExplainEdge, request, reply); !status.ok()) return status;
  return read_explanation(reply);
}

Result<std::vector<LabelledFrames>> Client::labels(const std::string& prefix, const std::string& words) {
  v1::FindLabelsRequest request;
  request.set_prefix(prefix);
  request.set_words(words);
  std::vector<LabelledFrames> all;
  const Status status =
      impl_->list<v1::FindLabelsReply>(&MapStub::FindLabels, request, [&](const v1::FindLabelsReply& page) -> Status {
        for (const v1::LabelledFrames& message : page.labels()) {
          LabelledFrames& label = all.emplace_back();
          label.label = message.label();
          for (const v1::FrameId& id : message.frames()) label.frames.push_back(read_id(id));
        }
        return {};
      });
  if (!status.ok()) return status;
  return all;
}

Result<EdgeEdit> Client::edit_edge(EdgeId edge, EdgeAction action, const EditOptions& options) {
  v1::SetEdgeStateRequest request;
  *request.mutable_edge() = to_wire(edge);
  request.set_alone(action == EdgeAction::kRemoveAlone);
  request.set_state(action == EdgeAction::kRemove || request.alone() ? v1::EDGE_STATE_REMOVED
                    : action == EdgeAction::kWithdraw                ? v1::EDGE_STATE_CANDIDATE
                                                                     : v1::EDGE_STATE_ACCEPTED);
  request.set_decided(action == EdgeAction::kAccept);
  request.set_note(options.note);
  request.set_dry_run(options.dry_run);
  request.set_shown(options.shown);
  request.set_idempotency_key(SessionUuid::random().to_string());
  v1::SetEdgeStateReply reply;
  if (Status status = impl_->ask_map(&MapStub::SetEdgeState, request, reply); !status.ok()) return status;
  auto after = read_edge(reply.edge());
  if (!after.ok()) return after.status();
  auto effect = read_effect(reply.effect());
  if (!effect.ok()) return effect.status();
  return EdgeEdit{std::move(after).value(), std::move(effect).value(), !options.dry_run, reply.shown()};
}

Result<EdgeEdit> Client::propose_edge(FrameId a, FrameId b, bool accept, const EditOptions& options) {
  v1::ProposeEdgeRequest request;
  *request.mutable_a() = to_wire(a);
  *request.mutable_b() = to_wire(b);
  request.set_accept(accept);
  request.set_note(options.note);
  request.set_dry_run(options.dry_run);
  request.set_idempotency_key(SessionUuid::random().to_string());
  v1::ProposeEdgeReply reply;
  if (Status status = impl_->ask_map(&MapStub::ProposeEdge, request, reply); !status.ok()) return status;
  auto after = read_edge(reply.edge());
  if (!after.ok()) return after.status();
  auto effect = read_effect(reply.effect());
  if (!effect.ok()) return effect.status();
  return EdgeEdit{std::move(after).value(), std::move(effect).value(), !options.dry_run};
}

Result<std::vector<std::string>> Client::set_label(FrameId frame, const std::string& label, bool present) {
  if (!is_utf8(label)) return {Reason::BAD_NAME, "label is not UTF-8"};  // the reason that the daemon would give
  v1::SetLabelRequest request;
  *request.mutable_frame() = to_wire(frame);
  request.set_label(label);
  request.set_remove(!present);
  request.set_idempotency_key(SessionUuid::random().to_string());
  v1::SetLabelReply reply;
  if (Status status = impl_->ask_map(&MapStub::SetLabel, request, reply); !status.ok()) return status;
  return std::vector<std::string>(reply.labels().begin(), reply.labels().end());
}

Result<SessionNumber> Client::import_graph(const GraphPiece& piece) {
  v1::ImportGraphRequest request;
  request.set_session_uuid(uuid_to_wire(piece.session));
  request.set_robot(piece.robot);
  request.set_name(piece.name);
  request.set_first(piece.first);
  for (const GraphPiece::Frame& frame : piece.frames) {
    v1::ImportedFrame& message = *request.add_frames();
    *message.mutable_odom_from_frame() = to_wire(frame.T_odom_frame);
    if (frame.step_covariance) *message.mutable_step() = to_wire(*frame.step_covariance);
    message.set_time_us(static_cast<std::uint64_t>(frame.time_us));
    message.set_driven_us(static_cast<std::uint64_t>(frame.driven_us));
  }
  for (const GraphPiece::Loop& loop : piece.loops) {
    v1::ImportedLoop& message = *request.add_loops();
    message.set_query(loop.query);
    message.set_match(loop.match);
    *message.mutable_match_from_query() = to_wire(loop.T_match_query);
    *message.mutable_covariance() = to_wire(loop.covariance);
  }
  v1::ImportGraphReply reply;
  if (Status status = impl_->ask_map(&MapStub::ImportGraph, request, reply); !status.ok()) return status;
  return reply.session();
}

namespace {

v1::ExportRequest export_request(v1::ExportFormat format, const std::vector<SessionNumber>& sessions) {
  v1::ExportRequest request;
  request.set_format(format);
  for (const SessionNumber session : sessions) request.add_sessions(session);
  return request;
}

}  // namespace

Status Client::export_trajectories(ExportFormat format, const std::vector<SessionNumber>& sessions,
                                   const TrajectorySink& take) {
  return impl_->read_stream<v1::ExportReply>(&MapStub::Export,
                                             export_request(static_cast<v1::ExportFormat>(format), sessions),
                                             [&](const v1::ExportReply& reply) -> Status {
                                               TrajectoryPiece piece{reply.session(), reply.data(), {}};
                                               for (const v1::Edge& message : reply.unmeasured()) {
                                                 auto edge = read_edge(message);
                                                 if (!edge.ok()) return edge.status();
                                                 piece.doubtful.push_back(std::move(edge).value());
                                               }
                                               return take(piece);
                                             });
}

Status Client::export_frames(const std::vector<SessionNumber>& sessions, bool landmarks, const FrameSink& take) {
  v1::ExportRequest request = export_request(v1::EXPORT_FORMAT_FRAMES, sessions);
  request.set_landmarks(landmarks);
  return impl_->read_stream<v1::ExportReply>(&MapStub::Export, std::move(request),
                                             [&](const v1::ExportReply& reply) -> Status {
                                               for (const v1::ExportedFrame& message : reply.frames()) {
                                                 const auto frame = read_exported(message);
                                                 if (!frame.ok()) return frame.status();
                                                 if (Status status = take(*frame); !status.ok()) return status;
                                               }
                                               return {};
                                             });
}

Result<Skeleton> Client::skeleton(const SkeletonOptions& options, const SkeletonSink& take) {
  v1::GetSkeletonRequest request;
  request.set_level(options.level);
  for (const SessionNumber session : options.sessions) request.add_sessions(session);
  request.set_candidates(options.candidates);
  Skeleton skeleton;
  const Status status = impl_->read_stream<v1::GetSkeletonReply>(
      &MapStub::GetSkeleton, std::move(request), [&](const v1::GetSkeletonReply& reply) -> Status {
        if (Status read = read_skeleton_part(reply, skeleton); !read.ok()) return read;
        return take ? take(skeleton) : Status();
      });
  if (!status.ok()) return status;
  return skeleton;
}

}  // namespace relmap::client
