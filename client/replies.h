// Converts messages to and from the types of map_types.h. Internal to client/.
#pragma once

#include "client/admin_types.h"
#include "client/evidence_types.h"
#include "client/map_types.h"
#include "client/skeleton.h"
#include "client/watch_types.h"

namespace relmap::v1 {
class AuditEntry;
class ClosureMatrixCell;
class Edge;
class EdgeId;
class EditEffect;
class ExplainEdgeReply;
class ExportedFrame;
class FindRouteReply;
class FindRouteRequest;
class Frame;
class FrameId;
class GetNeighbourhoodReply;
class GetSkeletonReply;
class GetStatusReply;
class Robot;
class ListEdgesRequest;
class LocaliseReply;
class MapEvent;
class MatchImageReply;
class Session;
class TransformBetweenReply;
class View;
}  // namespace relmap::v1

namespace relmap::client {

v1::View view_message(const View& view);
v1::FindRouteRequest route_message(const RouteRequest& asked);
v1::ListEdgesRequest edges_message(const EdgeFilter& filter);

// CORRUPT: the daemon's reply is malformed.
Result<Edge> read_edge(const v1::Edge& message);
Result<Neighbourhood> read_neighbourhood(const v1::GetNeighbourhoodReply& message);
Result<EdgeExplanation> read_explanation(const v1::ExplainEdgeReply& message);
ClosureMatrixCell read_cell(const v1::ClosureMatrixCell& message);
AuditEntry read_audit(const v1::AuditEntry& message);
Result<EditEffect> read_effect(const v1::EditEffect& message);
Result<ExportedFrame> read_exported(const v1::ExportedFrame& message);
Result<Frame> read_frame(const v1::Frame& message);
Result<Session> read_session(const v1::Session& message);
Result<Localisation> read_localisation(const v1::LocaliseReply& message);
Result<PlaceMatches> read_matches(const v1::MatchImageReply& message);
// Adds a message of the stream to the route or to one of its alternatives.
Status read_route_reply(const v1::FindRouteReply& message, Route& route);
Result<TransformBetween> read_transform(const v1::TransformBetweenReply& message);
// Adds what a message tells to what the ones before it told.
Status read_skeleton_part(const v1::GetSkeletonReply& message, Skeleton& skeleton);
DaemonStatus read_status(const v1::GetStatusReply& message);
RobotStatus read_robot(const v1::Robot& message);
// Nullopt: an event of a kind that a later version tells.
Result<std::optional<WatchEvent>> read_event(const v1::MapEvent& message);

FrameId read_id(const v1::FrameId& id);
EdgeId read_id(const v1::EdgeId& id);

}  // namespace relmap::client
