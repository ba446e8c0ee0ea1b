// The map of a running relmapd, over its RPC API.
//
//   auto client = client::Client::connect("/var/lib/relmap");       // or "host:port"
//   if (!client.ok()) return client.status();
//   auto route = (*client)->find_route({.from = FrameId{1, 20}, .to = "kitchen"});
//
// Every call returns what the daemon answered, or the daemon's reason; UNREACHABLE where none answers, DEADLINE where
// it took too long. Thread-safe.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/admin_types.h"
#include "client/map_types.h"

namespace relmap::client {

struct ClientOptions {
  std::chrono::milliseconds connect_timeout{5000};
  std::chrono::milliseconds deadline{60000};  // of each call; streams and lists count as one
  // Called with the canonical proto3 JSON of each message received, in order, by the calling thread.
  std::function<void(const std::string& json)> on_reply;
};

class Client {
 public:
  // `server`: the data folder of a daemon on this machine (DIR/endpoint says where it answers), or HOST:PORT.
  // INVALID_ARGUMENT: neither. UNREACHABLE, with why.
  static Result<std::unique_ptr<Client>> connect(const std::string& server, ClientOptions options = {});
  ~Client();
  // Another client of the same server, with the same options, where it answers now: a daemon that was started anew may
  // do so at another port. As connect().
  Result<std::unique_ptr<Client>> connect_again() const;

  Result<DaemonStatus> status();
  // Returns when the daemon has applied, looked up and relaxed all that it took in.
  Status wait_idle();

  // `prior`: a frame somewhere near; tried first, and the rest of the map only if it is not there.
  Result<Localisation> localise(const View& view, std::optional<FrameId> prior = {});
  Result<PlaceMatches> match_image(const View& view, const MatchOptions& options = {});
  // A stream that breaks is resumed, on the version of the map on which it began.
  Result<Route> find_route(const RouteRequest& request);
  Result<TransformBetween> transform_between(FrameId a, FrameId b);

  Result<Frame> frame(FrameId id, bool with_thumbnail = false);
  // Sessions heard of in the last minute, by robot and session.
  Result<std::vector<RobotStatus>> robots();
  // Whole lists, page by page from one map version; VIEW_EXPIRED if it went meanwhile.
  Result<std::vector<Session>> sessions();
  Result<std::vector<Edge>> edges(const EdgeFilter& filter = {});
  Result<std::vector<LabelledFrames>> labels(const std::string& prefix = "", const std::string& words = "");

  Result<EdgeEdit> edit_edge(EdgeId edge, EdgeAction action, const EditOptions& options = {});
  // What geometry finds between two frames, as a loop closure that is judged like any other; `accept`: put into force.
  // Why it finds nothing: TOO_FEW_INLIERS and others. WRONG_STATE: there is a closure between the two.
  Result<EdgeEdit> propose_edge(FrameId a, FrameId b, bool accept = false, const EditOptions& options = {});
  // The frame's labels afterwards.
  Result<std::vector<std::string>> set_label(FrameId frame, const std::string& label, bool present = true);

  // A graph made elsewhere, piece by piece in the order of its frames: the session's number. See Map.ImportGraph.
  Result<SessionNumber> import_graph(const GraphPiece& piece);

  // Sessions (none: all but mono sessions) as streams; what `take` returns ends them. A stream that breaks is resumed.
  // Each session's file, in order, in pieces: its odometry edges, chained.
  using TrajectorySink = std::function<Status(const TrajectoryPiece& piece)>;
  Status export_trajectories(ExportFormat format, const std::vector<SessionNumber>& sessions,
                             const TrajectorySink& take);
  // Each session's frames, ascending, with their landmarks if they are wanted.
  using FrameSink = std::function<Status(const ExportedFrame& frame)>;
  Status export_frames(const std::vector<SessionNumber>& sessions, bool landmarks, const FrameSink& take);

  // For operators. The work is the daemon's; one piece of it at a time (BUDGET_EXCEEDED). DEADLINE also when
  // `on_progress` has ended it.
  Result<VerifySummary> verify(const std::vector<SessionNumber>& sessions,
                               const std::function<void(const Finding&)>& on_finding, const OnProgress& on_progress);
  // `folder`: on the daemon's machine, absolute.
  Result<Backup> backup(const std::string& folder, const OnProgress& on_progress);
  Result<Compaction> compact(const OnProgress& on_progress);
  Result<StoreStats> stats();
  // A frozen session takes nothing in, and nothing in it moves.
  Status freeze_session(SessionNumber session, bool frozen = true);
  // Returns when all its frames are gone; DEADLINE: the daemon goes on with it. `uuid`: of that session, to be sure.
  Status delete_session(SessionNumber session, const std::string& uuid, const OnProgress& on_progress);
  // What is dirty, now; the journal sequence that is committed then.
  Result<std::uint64_t> commit();

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::client
