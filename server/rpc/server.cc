#include "server/rpc/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>

#include <mutex>
#include <thread>
#include <vector>

#include "frontend/vision/picture.h"
#include "server/rpc/gateway.h"
#include "server/rpc/services.h"
#include "server/rpc/unreadable_request.h"

namespace relmap::rpc {

namespace {

// Two pictures and the rest of their message.
constexpr int kMaxRequestBytes = 2 * static_cast<int>(vision::kMaxPictureBytes) + (1 << 20);

// Memory that gRPC may use for incoming requests and for replies that are not taken. Beyond it gRPC stops reading.
constexpr std::size_t kTransportBytes = kMaxRequestBytes + (std::size_t{16} << 20);

// How long Shutdown() waits for what is not a call of ours (health watches, idle connections).
constexpr std::chrono::milliseconds kGrace{50};

// Plugins are global, and a ServerBuilder reads them when it is constructed.
void enable_plugins() {
  static std::once_flag once;
  std::call_once(once, [] {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  });
}

std::string address_of(const ServerOptions& options) {
  const bool v6 = options.host.find(':') != std::string::npos;
  return (v6 ? "[" + options.host + "]" : options.host) + ":" + std::to_string(options.port);
}

}  // namespace

struct RpcServer::Impl {
  // The mapper's budget outlives the server: the core holds both.
  Impl(Core& core, const RpcLimits& limits) : gateway(limits, core.mapper.budget(), core.metrics) {}

  Gateway gateway;
  std::vector<std::unique_ptr<grpc::Service>> services;
  std::unique_ptr<grpc::Server> server;  // destroyed before the services
  int port = 0;
  bool stopped = false;
};

RpcServer::RpcServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

RpcServer::~RpcServer() { stop(std::chrono::milliseconds(0)); }

Result<std::unique_ptr<RpcServer>> RpcServer::start(Core& core, const ServerOptions& options) {
  enable_plugins();
  auto impl = std::make_unique<Impl>(core, core.limits);
  impl->services.push_back(make_map_service(core, impl->gateway));
  impl->services.push_back(make_ingest_service(core, impl->gateway));
  impl->services.push_back(make_admin_service(core, impl->gateway));

  grpc::ServerBuilder builder;
  // Otherwise two daemons would silently share the port.
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder.SetMaxReceiveMessageSize(kMaxRequestBytes);
  // The stream of a robot that drives out of radio range is closed after half a minute.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);  // any number
  builder.SetResourceQuota(grpc::ResourceQuota("relmapd").Resize(kTransportBytes));
  const std::string address = address_of(options);
  builder.AddListeningPort(address, grpc::InsecureServerCredentials(), &impl->port);
  for (const auto& service : impl->services) builder.RegisterService(service.get());
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(name_unreadable_requests());
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  impl->server = builder.BuildAndStart();
  if (!impl->server || impl->port == 0) {
    impl->stopped = true;
    return {Reason::PORT_IN_USE,
            "cannot listen on " + address + ": another process uses it, or it is not an address of this machine"};
  }
  return std::unique_ptr<RpcServer>(new RpcServer(std::move(impl)));
}

std::uint16_t RpcServer::port() const { return static_cast<std::uint16_t>(impl_->port); }

void RpcServer::stop(std::chrono::milliseconds patience) {
  if (impl_->stopped) return;
  impl_->stopped = true;
  if (auto* health = impl_->server->GetHealthCheckService()) health->SetServingStatus(false);
  impl_->gateway.drain();
  // Waits for calls only: Shutdown() would also wait for idle connections, whose clients may take seconds to notice.
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (impl_->gateway.calls() > 0 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  impl_->server->Shutdown(std::chrono::system_clock::now() + kGrace);
  impl_->server->Wait();
}

}  // namespace relmap::rpc
