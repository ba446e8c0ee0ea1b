#include "tests/support/map_stub.h"

#include "proto/wire/convert.h"

namespace relmap::testing {

MapStub::MapStub(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(64 << 20);
  arguments.SetMaxSendMessageSize(64 << 20);
  stub_ = v1::Map::NewStub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
}

Status MapStub::status_of(const grpc::Status& status) {
  if (status.ok()) return {};
  v1::Error error;
  if (error.ParseFromString(status.error_details()) && error.reason() != v1::REASON_OK)
    return {reason_from_wire(error.reason()), error.message()};
  return {Reason::INTERNAL, "no reason given: " + status.error_message()};
}

Result<v1::FindRouteReply> MapStub::find_route(const v1::FindRouteRequest& request) {
  return patiently<v1::FindRouteReply>([&](grpc::ClientContext* context, v1::FindRouteReply* whole) {
    const auto stream = stub_->FindRoute(context, request);
    v1::FindRouteReply piece;
    while (stream->Read(&piece)) {
      whole->MergeFrom(piece);
      whole->clear_resume_token();
    }
    return stream->Finish();
  });
}

}  // namespace relmap::testing
