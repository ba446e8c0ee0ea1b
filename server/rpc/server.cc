#include "server/rpc/server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/security/tls_certificate_provider.h>
#include <grpcpp/security/tls_credentials_options.h>
#include <sys/stat.h>

#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "frontend/vision/picture.h"
#include "proto/access/certificate.h"
#include "proto/access/file.h"
#include "server/rpc/caller.h"
#include "server/rpc/gateway.h"
#include "server/rpc/services.h"
#include "server/rpc/unreadable_request.h"

namespace relmap::rpc {

namespace {

// Two pictures and the rest of their message.
constexpr int kMaxRequestBytes = 2 * static_cast<int>(vision::kMaxPictureBytes) + (1 << 20);

// Memory that gRPC may use for incoming requests and for replies that are not taken, and for each connection. Beyond it
// gRPC stops reading, and closes connections, whosever they are: as many as may be open must have room.
constexpr std::size_t kTransportBytes = kMaxRequestBytes + (std::size_t{16} << 20);
constexpr std::size_t kConnectionBytes = 64 << 10;

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

constexpr unsigned kTlsRefresh_s = 10;           // between looks at the files of TLS
constexpr int kHandshake_ms = 10'000;            // that a caller may take for the handshakes of TLS and HTTP/2
constexpr int kMaxIdle_ms = 600'000;             // without a call; then the connection is closed
constexpr int kMaxStreamsOfAConnection = 1'000;  // calls at once

// TLS 1.2 or later. A caller may show a certificate; one that cannot be verified ends the handshake.
std::shared_ptr<grpc::ServerCredentials> tls_credentials(const TlsFiles& files) {
  grpc::experimental::TlsServerCredentialsOptions options(
      std::make_shared<grpc::experimental::FileWatcherCertificateProvider>(files.key, files.certificate,
                                                                           files.client_authority, kTlsRefresh_s));
  options.watch_identity_key_cert_pairs();
  options.set_cert_request_type(GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  if (!files.client_authority.empty()) {
    options.watch_root_certs();
    options.set_cert_request_type(GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY);
  }
  return grpc::experimental::TlsServerCredentials(options);
}

using Acceptor = std::shared_ptr<grpc::experimental::ExternalConnectionAcceptor>;

void hand_over(const Acceptor& acceptor, int listening, int connection) {
  grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
  parameters.listener_fd = listening;
  parameters.fd = connection;
  acceptor->HandleNewConnection(&parameters);
}

}  // namespace

struct RpcServer::Impl {
  // The mapper's budget outlives the server: the core holds both.
  Impl(Core& core, const Gatekeeper& gatekeeper, const ServerOptions& options)
      : transport(core.transport),
        audit(core.audit),
        connections(options.connections),
        gateway(core.limits, core.mapper.budget(), core.metrics, gatekeeper, connections, options.audit) {
    transport = {&connections, &gatekeeper, options.tls_watch, &gateway};
    audit = {options.audit};
  }
  ~Impl() {
    transport = {};
    audit = {};
  }

  Transport& transport;
  Audit& audit;
  Connections connections;
  Gateway gateway;
  std::vector<std::unique_ptr<grpc::Service>> services;
  std::unique_ptr<grpc::Server> server;  // destroyed before the services
  std::unique_ptr<Listener> listener;    // destroyed before the server
  std::uint16_t port = 0;
  Mutex health_mutex;
  bool leaving RELMAP_GUARDED_BY(health_mutex) = false;  // nothing is SERVING any more
  bool stopped = true;
};

RpcServer::RpcServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

RpcServer::~RpcServer() { stop(std::chrono::milliseconds(0)); }

Result<std::unique_ptr<RpcServer>> RpcServer::start(Core& core, const Gatekeeper& gatekeeper,
                                                    const ServerOptions& options) {
  enable_plugins();
  auto impl = std::make_unique<Impl>(core, gatekeeper, options);
  impl->services.push_back(make_map_service(core, impl->gateway));
  impl->services.push_back(make_ingest_service(core, impl->gateway));
  impl->services.push_back(make_admin_service(core, impl->gateway));

  grpc::ServerBuilder builder;
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshake_ms);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxStreamsOfAConnection);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS, kMaxIdle_ms);
  builder.SetMaxReceiveMessageSize(kMaxRequestBytes);
  // The stream of a robot that drives out of radio range is closed after half a minute.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 20'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);  // any number
  builder.SetResourceQuota(
      grpc::ResourceQuota("relmapd").Resize(kTransportBytes + options.connections.total * kConnectionBytes));
  std::vector<Listener::Source> sources;
  const auto accepted_by = [&](std::shared_ptr<grpc::ServerCredentials> credentials) -> Acceptor {
    return builder.experimental().AddExternalConnectionAcceptor(
        grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, std::move(credentials));
  };
  if (!options.socket.empty()) {
    auto socket = ListeningSocket::at_path(options.socket, options.socket_group);
    if (!socket.ok()) return socket.status();
    sources.push_back(
        {std::move(*socket), [acceptor = accepted_by(grpc::experimental::LocalServerCredentials(UDS))](
                                 int listening, int connection) { hand_over(acceptor, listening, connection); }});
  }
  if (!options.host.empty()) {
    auto sockets = ListeningSocket::at_host(options.host, options.port);
    if (!sockets.ok()) return sockets.status();
    impl->port = sockets->front().port();
    const bool tls = !options.tls.certificate.empty();
    if (Status sound = check_files(options.tls); !sound.ok()) return sound;
    // Callers of this machine, who may ask for health without credentials, and others.
    const auto acceptor_for = [&](bool here) {
      std::shared_ptr<grpc::ServerCredentials> credentials =
          tls ? tls_credentials(options.tls) : grpc::InsecureServerCredentials();
      if (tls) credentials->SetAuthMetadataProcessor(turn_strangers_away(gatekeeper, here));
      return accepted_by(std::move(credentials));
    };
    const Acceptor here = acceptor_for(true), elsewhere = acceptor_for(false);
    const Listener::Take take = [here, elsewhere](int listening, int connection) {
      hand_over(is_of_this_machine(connection) ? here : elsewhere, listening, connection);
    };
    for (ListeningSocket& socket : *sockets) sources.push_back({std::move(socket), take});
  }
  for (const auto& service : impl->services) builder.RegisterService(service.get());
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(name_unreadable_requests());
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  impl->server = builder.BuildAndStart();
  if (!impl->server) return Status(Reason::INTERNAL, "gRPC cannot start a server");
  for (const char* service : {"", "relmap.v1.Map", "relmap.v1.Ingest", "relmap.v1.Admin"})
    if (auto* health = impl->server->GetHealthCheckService()) health->SetServingStatus(service, true);
  impl->stopped = false;
  impl->listener = std::make_unique<Listener>(std::move(sources), impl->connections);
  return std::unique_ptr<RpcServer>(new RpcServer(std::move(impl)));
}

std::uint16_t RpcServer::port() const { return impl_->port; }

void RpcServer::set_serving(const std::string& service, bool serving) {
  const MutexLock lock(impl_->health_mutex);
  if (auto* health = impl_->server->GetHealthCheckService(); health && !impl_->leaving)
    health->SetServingStatus(service, serving);
}

void RpcServer::announce_stop() {
  const MutexLock lock(impl_->health_mutex);
  if (std::exchange(impl_->leaving, true)) return;
  if (auto* health = impl_->server->GetHealthCheckService()) health->SetServingStatus(false);
}

void RpcServer::stop(std::chrono::milliseconds patience) {
  if (impl_->stopped) return;
  impl_->stopped = true;
  announce_stop();
  impl_->listener->stop();
  impl_->gateway.drain();
  // Waits for calls only: Shutdown() would also wait for idle connections, whose clients may take seconds to notice.
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (impl_->gateway.calls() > 0 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  impl_->server->Shutdown(std::chrono::system_clock::now() + kGrace);
  impl_->server->Wait();
}

}  // namespace relmap::rpc
