#include "server/rpc/unreadable_request.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "server/rpc/error_mapping.h"
#include "server/rpc/roles.h"

namespace relmap::rpc {

namespace {

using grpc::experimental::InterceptionHookPoints;

// "Map.SetLabel" of "/relmap.v1.Map/SetLabel"
std::string name_of(std::string_view path) {
  std::string name(path.substr(path.find_last_of('.') + 1));
  std::replace(name.begin(), name.end(), '/', '.');
  return name;
}

class NamesIt final : public grpc::experimental::Interceptor {
 public:
  explicit NamesIt(std::string method) : method_(std::move(method)) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* batch) override {
    if (batch->QueryInterceptionHookPoint(InterceptionHookPoints::PRE_SEND_STATUS)) {
      const grpc::Status status = batch->GetSendStatus();
      // Statuses of our own have a message.
      if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED && status.error_message().empty())
        batch->ModifySendStatus(
            to_grpc({Reason::INVALID_ARGUMENT,
                     "the request of " + method_ + " cannot be read: its bytes are damaged, or a text is not UTF-8"},
                    ""));
    }
    batch->Proceed();
  }

 private:
  const std::string method_;
};

class Factory final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  grpc::experimental::Interceptor* CreateServerInterceptor(grpc::experimental::ServerRpcInfo* info) override {
    if (info->type() == grpc::experimental::ServerRpcInfo::Type::BIDI_STREAMING) return nullptr;
    std::string method = name_of(info->method());
    return required_role(method) ? new NamesIt(std::move(method)) : nullptr;  // gRPC takes ownership
  }
};

}  // namespace

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> name_unreadable_requests() {
  return std::make_unique<Factory>();
}

}  // namespace relmap::rpc
