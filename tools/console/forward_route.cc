#include "tools/console/forward_route.h"

#include <array>
#include <functional>
#include <utility>

#include "tools/console/forward/grpc_web.h"

namespace relmap::console {

namespace {

constexpr std::size_t kMaxMessage = std::size_t{16} << 20;
constexpr std::string_view kType = "application/grpc-web+proto";
// What is passed on of a request's headers, as it is.
constexpr std::array<std::string_view, 2> kPassedOn{"x-request-id", "traceparent"};

// The daemon tells everyone its health.
bool is_judged(std::string_view service) { return service.starts_with("relmap.v1."); }

bool is_grpc_web(std::string_view type) {
  const std::string_view name = type.substr(0, type.find(';'));
  return name == kType || name == "application/grpc-web";
}

Awaitable<std::optional<Response>> forward(DaemonLink& link, Login& login, Request& request, ResponseStream& stream) {
  if (!is_forwarded(request.parts.at(0), request.parts.at(1)))
    co_return error_response({Reason::NO_SUCH_FILE, "only methods of relmap.v1 and of gRPC's health are forwarded"});
  if (!is_grpc_web(request.header("content-type"))) {
    Response response = error_response({Reason::UNSUPPORTED, "the content has to be " + std::string(kType)});
    response.status = 415;
    co_return response;
  }
  const auto message = request_message(request.body, kMaxMessage);
  if (!message.ok()) {
    Response response = error_response(message.status());
    response.status = 400;
    co_return response;
  }
  if (Status admitted = co_await login.admit(request.caller); !admitted.ok()) co_return error_response(admitted);
  CallOptions options;
  options.token = request.caller.token;
  for (const std::string_view name : kPassedOn)
    if (const std::string_view value = request.header(name); !value.empty()) options.metadata.emplace_back(name, value);
  if (const std::string_view timeout = request.header("grpc-timeout"); !timeout.empty()) {
    options.timeout = timeout_of(timeout);
    if (!options.timeout)
      co_return error_response({Reason::INVALID_ARGUMENT, "'" + std::string(timeout) + "' is no grpc-timeout"});
  }
  // A stream may last for hours: the body, which is one frame, goes into the call.
  std::string asked = std::exchange(request.body, std::string());
  asked.erase(0, kFrameHead);
  Result<ForwardedCall> call = co_await link.call(request.path, std::move(asked), std::move(options));
  if (!call.ok()) co_return error_response(call.status());
  // Has a name, since GCC 12 destroys what a temporary closure in such an expression holds twice (its bug 99576).
  const std::function<bool()> gone = [&stream] { return stream.gone(); };
  std::optional<std::string> next = co_await call->next(gone);
  // Once the daemon has answered, gRPC does not hold what was sent any more.
  Response head;
  head.type = kType;
  stream.begin(std::move(head));
  if (is_judged(request.parts.at(0)) && (next || call->end().code == 0)) stream.let_in();
  while (next) {
    co_await stream.write(message_frame(*next));
    next = co_await call->next(gone);
  }
  co_await stream.write(trailers_frame(call->end()));
  co_return std::nullopt;
}

}  // namespace

void add_forwarding(DaemonLink& link, Login& login, Router& router) {
  Route route;
  route.method = "POST";
  route.pattern = "/*/*";
  route.stream = [&link, &login](Request& request, ResponseStream& stream) {
    return forward(link, login, request, stream);
  };
  route.body_limit = kMaxMessage + kFrameHead;
  router.add(std::move(route));
}

}  // namespace relmap::console
