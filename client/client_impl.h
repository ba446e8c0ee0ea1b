// The implementation of Client. Internal to client/.
#pragma once

#include <google/protobuf/util/json_util.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <stop_token>
#include <string>
#include <utility>

#include "client/relmap_client.h"
#include "client/request_text.h"
#include "client/rpc_error.h"
#include "relmap/v1/admin.grpc.pb.h"
#include "relmap/v1/map.grpc.pb.h"

namespace relmap::client {

inline constexpr int kMaxResumptions = 3;  // of a stream, without progress between them

struct Client::Impl {
  using Clock = std::chrono::system_clock;  // the clock of gRPC's deadlines

  Impl(std::string s, std::shared_ptr<grpc::Channel> c, ClientOptions o)
      : server(std::move(s)),
        channel(std::move(c)),
        options(std::move(o)),
        map(v1::Map::NewStub(channel)),
        admin(v1::Admin::NewStub(channel)) {}

  Clock::time_point deadline() const { return Clock::now() + options.deadline; }

  // Gives the call its deadline, and what names it in the daemon's logs. The call is cancelled if ClientOptions::stop
  // says so while what this returns lives.
  struct Cancel {
    grpc::ClientContext* context;
    void operator()() const { context->TryCancel(); }
  };
  [[nodiscard]] std::stop_callback<Cancel> begin(grpc::ClientContext& context, Clock::time_point until) const {
    context.set_deadline(until);
    name(context);
    return std::stop_callback<Cancel>(options.stop, Cancel{&context});
  }
  // How a call ended.
  Status end_of(const grpc::Status& status) const {
    if (!status.ok() && options.stop.stop_requested()) return stopped();
    return status_of(status);
  }
  static Status stopped() { return {Reason::SHUTTING_DOWN, "the call was cancelled, since its program stops"}; }
  void name(grpc::ClientContext& context) const {
    if (!options.request_id.empty()) context.AddMetadata("x-request-id", options.request_id);
    if (!options.traceparent.empty()) context.AddMetadata("traceparent", options.traceparent);
  }

  void tell(const google::protobuf::Message& reply) const {
    if (!options.on_reply) return;
    google::protobuf::util::JsonPrintOptions print;
    print.always_print_primitive_fields = true;
    std::string json;
    if (google::protobuf::util::MessageToJsonString(reply, &json, print).ok()) options.on_reply(json);
  }

  template <typename Stub, typename Method, typename Request, typename Reply>
  Status ask(Stub& stub, Method method, const Request& request, Reply& reply, Clock::time_point until) const {
    if (Status texts = check_texts(request); !texts.ok()) return texts;
    grpc::ClientContext context;
    const auto cancelled = begin(context, until);
    const Status status = end_of((stub.*method)(&context, request, &reply));
    if (status.ok()) tell(reply);
    return status;
  }
  template <typename Method, typename Request, typename Reply>
  Status ask_map(Method method, const Request& request, Reply& reply) const {
    return ask(*map, method, request, reply, deadline());
  }

  // Asks for the pages of a list. `take` is called with each, and returns whether it wants the next; its failure ends
  // the list.
  template <typename Reply, typename Stub, typename Method, typename Request, typename Take>
  Status list_until(Stub& stub, Method method, Request request, Take take) const {
    const Clock::time_point until = deadline();
    for (;;) {
      Reply page;
      if (Status status = ask(stub, method, request, page, until); !status.ok()) return status;
      const Result<bool> more = take(page);
      if (!more.ok()) return more.status();
      if (!*more || page.next_page_token().empty()) return {};
      request.set_page_token(page.next_page_token());
    }
  }
  // Asks for all pages of a list of the map. `take` is called with each; its failure ends the list.
  template <typename Reply, typename Method, typename Request, typename Take>
  Status list(Method method, Request request, Take take) const {
    return list_until<Reply>(*map, method, std::move(request), [&](const Reply& page) -> Result<bool> {
      if (Status status = take(page); !status.ok()) return status;
      return true;
    });
  }

  // Reads all messages of a stream. `take` is called with each; its failure ends the stream. A stream that breaks is
  // resumed.
  template <typename Reply, typename Method, typename Request, typename Take>
  Status read_stream(Method method, Request request, Take take) const {
    if (Status texts = check_texts(request); !texts.ok()) return texts;
    const Clock::time_point until = deadline();
    for (int broken = 0;;) {
      grpc::ClientContext context;
      const auto cancelled = begin(context, until);
      const auto stream = ((*map).*method)(&context, request);
      Reply reply;
      while (stream->Read(&reply)) {
        tell(reply);
        if (Status status = take(reply); !status.ok()) {
          context.TryCancel();
          static_cast<void>(stream->Finish());
          return status;
        }
        request.set_resume_token(reply.resume_token());
        broken = 0;
      }
      const Status end = end_of(stream->Finish());
      const bool resumable = end.reason() == Reason::UNREACHABLE && !request.resume_token().empty();
      if (!resumable || ++broken > kMaxResumptions) return end;
    }
  }

  const std::string server;  // as given to connect()
  const std::shared_ptr<grpc::Channel> channel;
  const ClientOptions options;
  const std::unique_ptr<v1::Map::Stub> map;
  const std::unique_ptr<v1::Admin::Stub> admin;
};

}  // namespace relmap::client
