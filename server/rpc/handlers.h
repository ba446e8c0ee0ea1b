// One function for each RPC: what it answers to a request, without gRPC. Behind request and deadline stand the parts of
// the daemon that it uses (call() in core.h passes them). They read one version of the map, throw
// StatusError where reads of it do, and check the deadline while they work. What each can refuse with is said in
// proto/relmap/v1/map.proto and admin.proto.
#pragma once

#include "server/rpc/core.h"
#include "server/rpc/deadline.h"
#include "server/rpc/producer.h"

namespace relmap::v1 {
class LocaliseRequest;
class LocaliseReply;
class MatchImageRequest;
class MatchImageReply;
class FindRouteRequest;
class FindRouteReply;
class GetNeighbourhoodRequest;
class GetNeighbourhoodReply;
class TransformBetweenRequest;
class TransformBetweenReply;
class GetFrameRequest;
class GetFrameReply;
class ListSessionsRequest;
class ListSessionsReply;
class ListEdgesRequest;
class ListEdgesReply;
class ExplainEdgeRequest;
class ExplainEdgeReply;
class SetEdgeStateRequest;
class SetEdgeStateReply;
class ProposeEdgeRequest;
class ProposeEdgeReply;
class SetLabelRequest;
class SetLogLevelRequest;
class SetLabelReply;
class SetLogLevelReply;
class ImportGraphRequest;
class ImportGraphReply;
class FindLabelsRequest;
class FindLabelsReply;
class ListRobotsRequest;
class ListRobotsReply;
class GetAcknowledgementRequest;
class Acknowledgement;
class FreezeSessionRequest;
class FreezeSessionReply;
class DeleteSessionRequest;
class GetStatusRequest;
class GetStatusReply;
class WatchMapRequest;
class MapEvent;
class ExportRequest;
class ExportReply;
class GetSkeletonRequest;
class GetSkeletonReply;
class WaitIdleRequest;
class WaitIdleReply;
class VerifyRequest;
class VerifyReply;
class RepairRequest;
class ReindexRequest;
class BackupRequest;
class CompactRequest;
class Progress;
class GetStatsRequest;
class GetStatsReply;
class CommitRequest;
class CommitReply;
class ListAuditRequest;
class ListAuditReply;
class GetClosureMatrixRequest;
class GetClosureMatrixReply;
}  // namespace relmap::v1

namespace relmap::rpc {

// Need the pictures' reserve of memory: one at a time (Lane::kPictures, with PictureTurn held).
Result<v1::LocaliseReply> localise(const v1::LocaliseRequest& request, const Deadline& deadline, map::Mapper& mapper);
Result<v1::MatchImageReply> match_image(const v1::MatchImageRequest& request, const Deadline& deadline,
                                        map::Mapper& mapper);

// Needs the pictures' reserve too if an end is a view.
Result<Producer<v1::FindRouteReply>> find_route(const v1::FindRouteRequest& request, const Deadline& deadline,
                                                map::Mapper& mapper, Routes& routes, const RpcLimits& limits);
bool needs_picture(const v1::FindRouteRequest& request);

Result<v1::GetNeighbourhoodReply> get_neighbourhood(const v1::GetNeighbourhoodRequest& request,
                                                    const Deadline& deadline, map::Mapper& mapper,
                                                    const RpcLimits& limits);
Result<v1::TransformBetweenReply> transform_between(const v1::TransformBetweenRequest& request,
                                                    const Deadline& deadline, map::Mapper& mapper,
                                                    const RpcLimits& limits);
Result<v1::GetFrameReply> get_frame(const v1::GetFrameRequest& request, const Deadline& deadline, map::Mapper& mapper);
Result<v1::ListSessionsReply> list_sessions(const v1::ListSessionsRequest& request, const Deadline& deadline,
                                            map::Mapper& mapper, ViewKeeper& views);
Result<v1::ListEdgesReply> list_edges(const v1::ListEdgesRequest& request, const Deadline& deadline,
                                      map::Mapper& mapper, ViewKeeper& views, const RpcLimits& limits);
Result<v1::GetClosureMatrixReply> get_closure_matrix(const v1::GetClosureMatrixRequest& request,
                                                     const Deadline& deadline, map::Mapper& mapper, ViewKeeper& views);
// Verifies at most two pairs of frames, from the features that are kept: no picture is decoded.
Result<v1::ExplainEdgeReply> explain_edge(const v1::ExplainEdgeRequest& request, const Deadline& deadline,
                                          map::Mapper& mapper, const RpcLimits& limits);
Result<v1::SetEdgeStateReply> set_edge_state(const v1::SetEdgeStateRequest& request, const Deadline& deadline,
                                             map::Mapper& mapper, EditLog& edits, const RpcLimits& limits);
// Takes the pictures' reserve for a moment, and waits for the disk without it.
Result<v1::ProposeEdgeReply> propose_edge(const v1::ProposeEdgeRequest& request, const Deadline& deadline,
                                          map::Mapper& mapper, EditLog& edits, const RpcLimits& limits,
                                          PictureTurn& turn);
Result<v1::SetLabelReply> set_label(const v1::SetLabelRequest& request, const Deadline& deadline, map::Mapper& mapper,
                                    EditLog& edits);
Result<v1::ImportGraphReply> import_graph(const v1::ImportGraphRequest& request, const Deadline& deadline,
                                          map::Mapper& mapper, ImportTurn& turn);
Result<v1::FindLabelsReply> find_labels(const v1::FindLabelsRequest& request, const Deadline& deadline,
                                        map::Mapper& mapper, ViewKeeper& views);
Result<v1::ListRobotsReply> list_robots(const v1::ListRobotsRequest& request, const Deadline& deadline,
                                        map::Mapper& mapper, const Intake& intake);
Result<v1::Acknowledgement> get_acknowledgement(const v1::GetAcknowledgementRequest& request, const Deadline& deadline,
                                                const Intake& intake);
Result<Producer<v1::Progress>> delete_session(const v1::DeleteSessionRequest& request, const Deadline& deadline,
                                              map::Mapper& mapper, EditLog& edits);
Result<v1::FreezeSessionReply> freeze_session(const v1::FreezeSessionRequest& request, const Deadline& deadline,
                                              map::Mapper& mapper, EditLog& edits);
Result<v1::GetStatusReply> get_status(const v1::GetStatusRequest& request, const Deadline& deadline,
                                      map::Mapper& mapper, const DaemonFacts& facts, const Routes& routes,
                                      const Intake& intake, const ProcessProbe& process, const Transport& transport,
                                      const HealthProbe& health, const Metrics& metrics);
// Each watcher reads the committed log of events by itself (map_watch.h).
Result<LiveProducer<v1::MapEvent>> watch_map(const v1::WatchMapRequest& request, const Deadline& deadline,
                                             map::Mapper& mapper, WatchFeed& feed);
Result<Producer<v1::ExportReply>> export_trajectories(const v1::ExportRequest& request, const Deadline& deadline,
                                                      map::Mapper& mapper, ViewKeeper& views);
Result<Producer<v1::GetSkeletonReply>> get_skeleton(const v1::GetSkeletonRequest& request, const Deadline& deadline,
                                                    map::Mapper& mapper, ViewKeeper& views);
Result<v1::WaitIdleReply> wait_idle(const v1::WaitIdleRequest& request, const Deadline& deadline, map::Mapper& mapper);

// Long work, on threads of its own (Lane::kMaintenance); each producer ends its work when it is destroyed.
Result<Producer<v1::VerifyReply>> verify_request(const v1::VerifyRequest& request, const Deadline& deadline,
                                                 map::Mapper& mapper, MaintenanceTurn& maintenance);
Result<Producer<v1::VerifyReply>> repair_request(const v1::RepairRequest& request, const Deadline& deadline,
                                                 const DaemonFacts& facts);
Result<Producer<v1::Progress>> reindex_request(const v1::ReindexRequest& request, const Deadline& deadline,
                                               const DaemonFacts& facts);
Result<Producer<v1::Progress>> backup(const v1::BackupRequest& request, const Deadline& deadline, map::Mapper& mapper,
                                      MaintenanceTurn& maintenance, const DaemonFacts& facts);
Result<Producer<v1::Progress>> compact(const v1::CompactRequest& request, const Deadline& deadline, map::Mapper& mapper,
                                       MaintenanceTurn& maintenance);
Result<v1::GetStatsReply> get_stats(const v1::GetStatsRequest& request, const Deadline& deadline, map::Mapper& mapper,
                                    const DaemonFacts& facts, const Routes& routes, const Intake& intake,
                                    const ProcessProbe& process, const Transport& transport, const HealthProbe& health,
                                    const Metrics& metrics);
Result<v1::SetLogLevelReply> change_log_level(const v1::SetLogLevelRequest& request, const Deadline& deadline);
Result<v1::ListAuditReply> list_audit(const v1::ListAuditRequest& request, const Deadline& deadline,
                                      map::Mapper& mapper, const Audit& audit);
Result<v1::CommitReply> commit(const v1::CommitRequest& request, const Deadline& deadline, map::Mapper& mapper);

}  // namespace relmap::rpc
