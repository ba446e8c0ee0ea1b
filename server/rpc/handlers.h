// One function for each RPC: what it answers to a request, without gRPC. They read one version of the map, throw
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
class SetEdgeStateRequest;
class SetEdgeStateReply;
class ProposeEdgeRequest;
class ProposeEdgeReply;
class SetLabelRequest;
class SetLabelReply;
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
class ExportRequest;
class ExportReply;
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
}  // namespace relmap::v1

namespace relmap::rpc {

// Need the pictures' reserve of memory: one at a time (Lane::kPictures).
Result<v1::LocaliseReply> localise(Core& core, const v1::LocaliseRequest& request, const Deadline& deadline);
Result<v1::MatchImageReply> match_image(Core& core, const v1::MatchImageRequest& request, const Deadline& deadline);

// Needs that reserve too if an end is a view.
Result<Producer<v1::FindRouteReply>> find_route(Core& core, const v1::FindRouteRequest& request,
                                                const Deadline& deadline);
bool needs_picture(const v1::FindRouteRequest& request);

Result<v1::GetNeighbourhoodReply> get_neighbourhood(Core& core, const v1::GetNeighbourhoodRequest& request,
                                                    const Deadline& deadline);
Result<v1::TransformBetweenReply> transform_between(Core& core, const v1::TransformBetweenRequest& request,
                                                    const Deadline& deadline);
Result<v1::GetFrameReply> get_frame(Core& core, const v1::GetFrameRequest& request, const Deadline& deadline);
Result<v1::ListSessionsReply> list_sessions(Core& core, const v1::ListSessionsRequest& request,
                                            const Deadline& deadline);
Result<v1::ListEdgesReply> list_edges(Core& core, const v1::ListEdgesRequest& request, const Deadline& deadline);
Result<v1::SetEdgeStateReply> set_edge_state(Core& core, const v1::SetEdgeStateRequest& request,
                                             const Deadline& deadline);
// Needs that reserve, too.
Result<v1::ProposeEdgeReply> propose_edge(Core& core, const v1::ProposeEdgeRequest& request, const Deadline& deadline);
Result<v1::SetLabelReply> set_label(Core& core, const v1::SetLabelRequest& request, const Deadline& deadline);
Result<v1::ImportGraphReply> import_graph(Core& core, const v1::ImportGraphRequest& request, const Deadline& deadline);
Result<v1::FindLabelsReply> find_labels(Core& core, const v1::FindLabelsRequest& request, const Deadline& deadline);
Result<v1::ListRobotsReply> list_robots(Core& core, const v1::ListRobotsRequest& request, const Deadline& deadline);
Result<v1::Acknowledgement> get_acknowledgement(Core& core, const v1::GetAcknowledgementRequest& request,
                                                const Deadline& deadline);
Result<Producer<v1::Progress>> delete_session(Core& core, const v1::DeleteSessionRequest& request,
                                              const Deadline& deadline);
Result<v1::FreezeSessionReply> freeze_session(Core& core, const v1::FreezeSessionRequest& request,
                                              const Deadline& deadline);
Result<v1::GetStatusReply> get_status(Core& core, const v1::GetStatusRequest& request, const Deadline& deadline);
Result<Producer<v1::ExportReply>> export_trajectories(Core& core, const v1::ExportRequest& request,
                                                      const Deadline& deadline);
Result<v1::WaitIdleReply> wait_idle(Core& core, const v1::WaitIdleRequest& request, const Deadline& deadline);

// Long work, on threads of its own (Lane::kMaintenance); each producer ends its work when it is destroyed.
Result<Producer<v1::VerifyReply>> verify_request(Core& core, const v1::VerifyRequest& request,
                                                 const Deadline& deadline);
Result<Producer<v1::VerifyReply>> repair_request(Core& core, const v1::RepairRequest& request,
                                                 const Deadline& deadline);
Result<Producer<v1::Progress>> reindex_request(Core& core, const v1::ReindexRequest& request, const Deadline& deadline);
Result<Producer<v1::Progress>> backup(Core& core, const v1::BackupRequest& request, const Deadline& deadline);
Result<Producer<v1::Progress>> compact(Core& core, const v1::CompactRequest& request, const Deadline& deadline);
Result<v1::GetStatsReply> get_stats(Core& core, const v1::GetStatsRequest& request, const Deadline& deadline);
Result<v1::CommitReply> commit(Core& core, const v1::CommitRequest& request, const Deadline& deadline);

}  // namespace relmap::rpc
