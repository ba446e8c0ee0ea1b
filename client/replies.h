// Converts messages to and from the types of map_types.h. Internal to client/.
#pragma once

#include "client/map_types.h"
#include "client/skeleton.h"

namespace relmap::v1 {
class Edge;
class EdgeId;
class EditEffect;
class ExportedFrame;
class FindRouteRequest;
class Frame;
class FrameId;
class GetSkeletonReply;
class GetStatusReply;
class Robot;
class LocaliseReply;
class MatchImageReply;
class RouteStep;
class RouteSummary;
class Session;
class TransformBetweenReply;
class View;
}  // namespace relmap::v1

namespace relmap::client {

v1::View view_message(const View& view);
v1::FindRouteRequest route_message(const RouteRequest& asked);

// CORRUPT: the daemon's reply is malformed.
Result<Edge> read_edge(const v1::Edge& message);
EditEffect read_effect(const v1::EditEffect& message);
Result<ExportedFrame> read_exported(const v1::ExportedFrame& message);
Result<Frame> read_frame(const v1::Frame& message);
Result<Session> read_session(const v1::Session& message);
Result<Localisation> read_localisation(const v1::LocaliseReply& message);
Result<PlaceMatches> read_matches(const v1::MatchImageReply& message);
Status read_route_summary(const v1::RouteSummary& message, Route& route);
Result<RouteStep> read_route_step(const v1::RouteStep& message);
Result<TransformBetween> read_transform(const v1::TransformBetweenReply& message);
// Adds what a message tells to what the ones before it told.
Status read_skeleton_part(const v1::GetSkeletonReply& message, Skeleton& skeleton);
DaemonStatus read_status(const v1::GetStatusReply& message);
RobotStatus read_robot(const v1::Robot& message);

FrameId read_id(const v1::FrameId& id);
EdgeId read_id(const v1::EdgeId& id);

}  // namespace relmap::client
