// The C++ client of a running relmapd.
//
//   auto client = client::Client::connect("/var/lib/relmap");       // or "host:port"
//   if (!client.ok()) return client.status();
//   auto route = (*client)->find_route({.from = FrameId{1, 20}, .to = "kitchen"});
//
// Every call returns the daemon's answer or its reason; UNREACHABLE if no daemon answers, DEADLINE if it takes too
// long. relmap/v1/map.proto and admin.proto list the reasons of each call. Thread-safe.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "client/admin_types.h"
#include "client/evidence_types.h"
#include "client/map_types.h"
#include "client/skeleton.h"
#include "client/watch_types.h"

namespace relmap::client {

struct ClientOptions {
  // With the names that $RELMAP_REQUEST_ID and $TRACEPARENT give the calls, as programs of a trace pass them on.
  static ClientOptions from_environment();

  std::chrono::milliseconds connect_timeout{5000};
  std::chrono::milliseconds deadline{60000};  // of each call; a whole stream or list is one call
  // File that proves who the caller is (proto/access/credentials.h), for daemons that serve TLS at HOST:PORT. Empty:
  // none, and no TLS. A daemon of this machine, named by its data folder, needs none.
  std::string credentials;
  // Instead of a file, for programs that call for others: a bearer token, and whose certificates a daemon at HOST:PORT
  // may show (PEM; empty: no TLS, and the token is not sent).
  std::string token = {}, authorities = {};
  // Names the calls in the daemon's logs (x-request-id: at most 64 letters, digits and "-_."); empty: the daemon makes
  // a name for each.
  std::string request_id;
  // The trace that the calls belong to (traceparent of W3C Trace Context), for the daemon's logs; empty: none.
  std::string traceparent;
  // Once it is asked to stop, from any thread, calls that run are cancelled, and these and all later ones end with
  // SHUTTING_DOWN; connecting does, too. Not for watches, which have WatchOptions::stopped.
  std::stop_token stop = {};
  // Called with the canonical proto3 JSON of each message received, in order, by the calling thread; of events of the
  // map with what they carry of a session or closure only.
  std::function<void(const std::string& json)> on_reply;
};

class Client {
 public:
  // `server`: the data folder of a daemon on this machine (DIR/endpoint says where it answers), or HOST:PORT.
  // INVALID_ARGUMENT: it is neither. UNREACHABLE: no daemon answers; the message says why. NO_SUCH_FILE, BAD_CONFIG:
  // the credentials cannot be used.
  static Result<std::unique_ptr<Client>> connect(const std::string& server, ClientOptions options = {});
  ~Client();
  // Connects to the same server with the same options again, since a restarted daemon may use another port. Fails as
  // connect() does.
  Result<std::unique_ptr<Client>> connect_again() const;
  // The same connection, with another deadline of each call.
  std::unique_ptr<Client> with_deadline(std::chrono::milliseconds deadline) const;

  Result<DaemonStatus> status();
  // Returns when the daemon has applied, looked up and relaxed all keyframes that it has.
  Status wait_idle();

  // `prior`: a frame near the view. Its surroundings are searched first, and the rest of the map only if the view is
  // not found there. `correspondences`: with the points that the view and the found frame both show.
  Result<Localisation> localise(const View& view, std::optional<FrameId> prior = {}, bool correspondences = false);
  Result<PlaceMatches> match_image(const View& view, const MatchOptions& options = {});
  // A stream that breaks is resumed with the same map version.
  Result<Route> find_route(const RouteRequest& request);
  Result<TransformBetween> transform_between(FrameId a, FrameId b);

  // `with_picture`: with the whole picture that the map keeps of the frame, if any.
  Result<Frame> frame(FrameId id, bool with_thumbnail = false, bool with_picture = false);
  // Sessions heard of in the last minute, by robot and session.
  Result<std::vector<RobotStatus>> robots();
  // Whole lists, all pages from one map version; VIEW_EXPIRED if that version expires meanwhile.
  Result<std::vector<Session>> sessions();
  Result<std::vector<Edge>> edges(const EdgeFilter& filter = {});
  // At most `max_frames` (0: 1000) of a region, those with the fewest edges to its root. NO_SUCH_FRAME.
  Result<Neighbourhood> neighbourhood(const Region& region, std::uint32_t max_frames = 0);
  // The loop closures between each two sessions that have any; `sessions`: only pairs with one of these; empty: all.
  Result<std::vector<ClosureMatrixCell>> closure_matrix(const std::vector<SessionNumber>& sessions = {});
  Result<std::vector<LabelledFrames>> labels(const std::string& prefix = "", const std::string& words = "");

  // What a loop closure is believed for. NO_SUCH_EDGE, ODOMETRY_EDGE.
  Result<EdgeExplanation> explain_edge(EdgeId edge, bool with_pictures = false);

  Result<EdgeEdit> edit_edge(EdgeId edge, EdgeAction action, const EditOptions& options = {});
  // Verifies two frames by geometry and proposes the result as a loop closure, which is judged like any other, or with
  // `accept` put into force. TOO_FEW_INLIERS and others: geometry does not confirm it. WRONG_STATE: there is already a
  // closure between the two.
  Result<EdgeEdit> propose_edge(FrameId a, FrameId b, bool accept = false, const EditOptions& options = {});
  // Adds a label, or removes it if `present` is false. Returns the frame's labels afterwards.
  Result<std::vector<std::string>> set_label(FrameId frame, const std::string& label, bool present = true);

  // Imports a piece of a graph that was made elsewhere; pieces come in the order of their frames. Returns the session's
  // number. See Map.ImportGraph.
  Result<SessionNumber> import_graph(const GraphPiece& piece);

  // Follows what happens to the map: calls `sink` with each event, by the calling thread, and ends with the status with
  // which the sink fails, or with OK once `options.stopped` says so. A watcher who watches from now on, then lists, and
  // applies all events to the lists, holds what the map holds. If the connection breaks, it is made again, with the
  // last token and by connect_again(); the sink is told of both. Without `reconnect` it ends with the reason, and it
  // always does with UNAUTHENTICATED, NOT_ALLOWED, INVALID_ARGUMENT (a token that was mangled), UNIMPLEMENTED (the
  // daemon is too old), CORRUPT, NO_SUCH_FILE and BAD_CONFIG (credentials). ClientOptions::deadline is not for watches.
  using WatchSink = std::function<Status(const WatchEvent& event)>;
  Status watch(const WatchOptions& options, const WatchSink& sink);

  // Exports sessions (empty: all but mono sessions). If `take` fails, the export ends with its status. A stream that
  // breaks is resumed.
  // The trajectory file of each session, in order and in pieces: its odometry edges, chained.
  using TrajectorySink = std::function<Status(const TrajectoryPiece& piece)>;
  Status export_trajectories(ExportFormat format, const std::vector<SessionNumber>& sessions,
                             const TrajectorySink& take);
  // The frames of each session, ascending, with their landmarks if `landmarks` is set.
  using FrameSink = std::function<Status(const ExportedFrame& frame)>;
  Status export_frames(const std::vector<SessionNumber>& sessions, bool landmarks, const FrameSink& take);

  // The shape of the map, or of some of its sessions, contracted for drawing. `take`, if it is not empty, sees it grow.
  // A stream that breaks is resumed with the same map version; VIEW_EXPIRED if that expires meanwhile.
  Result<Skeleton> skeleton(const SkeletonOptions& options = {}, const SkeletonSink& take = {});

  // For operators. The daemon does one of verify, backup and compact at a time (BUDGET_EXCEEDED). DEADLINE also if
  // `on_progress` ended the work.
  Result<VerifySummary> verify(const std::vector<SessionNumber>& sessions,
                               const std::function<void(const Finding&)>& on_finding, const OnProgress& on_progress);
  // `folder`: on the daemon's machine, absolute.
  Result<Backup> backup(const std::string& folder, const OnProgress& on_progress);
  Result<Compaction> compact(const OnProgress& on_progress);
  Result<StoreStats> stats();
  // What operators did and tried, the newest first. UNSUPPORTED: the daemon keeps no audit log.
  Result<AuditLog> audit(const AuditFilter& filter = {});
  // Changes what the daemon's log tells, until the next change or start, and returns the former level. Empty: only
  // asks. INVALID_ARGUMENT: there is no such level.
  Result<std::string> set_log_level(const std::string& level);
  // A frozen session accepts no keyframes, and its edges and landmarks do not change.
  Status freeze_session(SessionNumber session, bool frozen = true);
  // Returns when all frames of the session are deleted. DEADLINE: the daemon continues the deletion. `uuid` must be
  // that of the session, as a safeguard.
  Status delete_session(SessionNumber session, const std::string& uuid, const OnProgress& on_progress);
  // Commits what is dirty, and returns the journal sequence up to which the map is committed.
  Result<std::uint64_t> commit();

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::client
