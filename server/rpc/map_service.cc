#include "relmap/v1/map.grpc.pb.h"
#include "server/rpc/handlers.h"
#include "server/rpc/services.h"

namespace relmap::rpc {

namespace {

class MapService final : public v1::Map::CallbackService {
 public:
  MapService(Core& core, Gateway& gateway) : core_(core), gateway_(gateway) {}

  Unary* Localise(Context* context, const v1::LocaliseRequest* request, v1::LocaliseReply* reply) override {
    return unary(context, "Map.Localise", request, reply, localise, Lane::kPictures);
  }
  Unary* MatchImage(Context* context, const v1::MatchImageRequest* request, v1::MatchImageReply* reply) override {
    return unary(context, "Map.MatchImage", request, reply, match_image, Lane::kPictures);
  }
  Stream<v1::FindRouteReply>* FindRoute(Context* context, const v1::FindRouteRequest* request) override {
    const Lane lane = needs_picture(*request) ? Lane::kPictures : Lane::kGeneral;
    return stream<v1::FindRouteReply>(context, "Map.FindRoute", request, find_route, lane);
  }
  Unary* GetNeighbourhood(Context* context, const v1::GetNeighbourhoodRequest* request,
                          v1::GetNeighbourhoodReply* reply) override {
    return unary(context, "Map.GetNeighbourhood", request, reply, get_neighbourhood);
  }
  Unary* TransformBetween(Context* context, const v1::TransformBetweenRequest* request,
                          v1::TransformBetweenReply* reply) override {
    return unary(context, "Map.TransformBetween", request, reply, transform_between);
  }
  Unary* GetFrame(Context* context, const v1::GetFrameRequest* request, v1::GetFrameReply* reply) override {
    return unary(context, "Map.GetFrame", request, reply, get_frame);
  }
  Unary* ListSessions(Context* context, const v1::ListSessionsRequest* request, v1::ListSessionsReply* reply) override {
    return unary(context, "Map.ListSessions", request, reply, list_sessions);
  }
  Unary* ListEdges(Context* context, const v1::ListEdgesRequest* request, v1::ListEdgesReply* reply) override {
    return unary(context, "Map.ListEdges", request, reply, list_edges);
  }
  Unary* ExplainEdge(Context* context, const v1::ExplainEdgeRequest* request, v1::ExplainEdgeReply* reply) override {
    return unary(context, "Map.ExplainEdge", request, reply, explain_edge);
  }
  Unary* GetClosureMatrix(Context* context, const v1::GetClosureMatrixRequest* request,
                          v1::GetClosureMatrixReply* reply) override {
    return unary(context, "Map.GetClosureMatrix", request, reply, get_closure_matrix);
  }
  Unary* SetEdgeState(Context* context, const v1::SetEdgeStateRequest* request, v1::SetEdgeStateReply* reply) override {
    return unary(context, "Map.SetEdgeState", request, reply, set_edge_state, Lane::kEdits);
  }
  Unary* ProposeEdge(Context* context, const v1::ProposeEdgeRequest* request, v1::ProposeEdgeReply* reply) override {
    return unary(context, "Map.ProposeEdge", request, reply, propose_edge, Lane::kEdits);
  }
  Unary* SetLabel(Context* context, const v1::SetLabelRequest* request, v1::SetLabelReply* reply) override {
    return unary(context, "Map.SetLabel", request, reply, set_label, Lane::kEdits);
  }
  Unary* ImportGraph(Context* context, const v1::ImportGraphRequest* request, v1::ImportGraphReply* reply) override {
    return unary(context, "Map.ImportGraph", request, reply, import_graph, Lane::kEdits);
  }
  Unary* FindLabels(Context* context, const v1::FindLabelsRequest* request, v1::FindLabelsReply* reply) override {
    return unary(context, "Map.FindLabels", request, reply, find_labels);
  }
  Stream<v1::MapEvent>* WatchMap(Context* context, const v1::WatchMapRequest* request) override {
    return stream<v1::MapEvent>(context, "Map.WatchMap", request, watch_map, Lane::kWatches);
  }
  Unary* ListRobots(Context* context, const v1::ListRobotsRequest* request, v1::ListRobotsReply* reply) override {
    return unary(context, "Map.ListRobots", request, reply, list_robots);
  }
  Unary* GetStatus(Context* context, const v1::GetStatusRequest* request, v1::GetStatusReply* reply) override {
    return unary(context, "Map.GetStatus", request, reply, get_status);
  }
  Stream<v1::GetSkeletonReply>* GetSkeleton(Context* context, const v1::GetSkeletonRequest* request) override {
    return stream<v1::GetSkeletonReply>(context, "Map.GetSkeleton", request, get_skeleton);
  }
  Stream<v1::ExportReply>* Export(Context* context, const v1::ExportRequest* request) override {
    return stream<v1::ExportReply>(context, "Map.Export", request, export_trajectories);
  }

 private:
  template <typename Request, typename Reply, typename... Parts>
  Unary* unary(Context* context, const char* method, const Request* request, Reply* reply,
               Result<Reply> (*handler)(const Request&, const Deadline&, Parts...), Lane lane = Lane::kGeneral) {
    return gateway_.unary(context, method, lane, request, reply, [=, this](const Request& r, const Deadline& d) {
      return in_turn(lane, [&] { return call(core_, handler, r, d); });
    });
  }
  // `Messages` is a Producer or a LiveProducer.
  template <typename Reply, typename Messages, typename Request, typename... Parts>
  Stream<Reply>* stream(Context* context, const char* method, const Request* request,
                        Result<Messages> (*handler)(const Request&, const Deadline&, Parts...),
                        Lane lane = Lane::kGeneral) {
    return gateway_.stream<Reply>(context, method, lane, request, [=, this](const Request& r, const Deadline& d) {
      return in_turn(lane, [&] { return call(core_, handler, r, d); });
    });
  }
  template <typename Handler>
  auto in_turn(Lane lane, Handler handler) {
    if (lane != Lane::kPictures) return handler();
    const MutexLock lock(core_.pictures.mutex);
    return handler();
  }

  Core& core_;
  Gateway& gateway_;
};

}  // namespace

std::unique_ptr<grpc::Service> make_map_service(Core& core, Gateway& gateway) {
  return std::make_unique<MapService>(core, gateway);
}

}  // namespace relmap::rpc
