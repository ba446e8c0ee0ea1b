#include "server/rpc/caller.h"

#include <grpc/grpc_security_constants.h>
#include <spdlog/spdlog.h>

#include <map>
#include <string>
#include <string_view>

namespace relmap::rpc {

namespace {

using Metadata = std::multimap<grpc::string_ref, grpc::string_ref>;

constexpr std::string_view kLocalSecurity = "local";  // as gRPC calls a Unix socket
constexpr std::string_view kBearer = "Bearer ", kHealth = "/grpc.health.v1.Health/";

std::string_view view(const grpc::string_ref& text) { return {text.data(), text.size()}; }

std::string_view value_of(const Metadata& metadata, const char* key) {
  const auto found = metadata.find(key);
  return found == metadata.end() ? std::string_view() : view(found->second);
}

std::string_view property_of(const grpc::AuthContext& connection, const char* name) {
  const auto values = connection.FindPropertyValues(name);
  return values.empty() ? std::string_view() : view(values.front());
}

Evidence evidence_of(const Metadata& metadata, const grpc::AuthContext& connection) {
  Evidence evidence;
  const std::string_view security = property_of(connection, GRPC_TRANSPORT_SECURITY_TYPE_PROPERTY_NAME);
  if (security == GRPC_SSL_TRANSPORT_SECURITY_TYPE || security == GRPC_TLS_TRANSPORT_SECURITY_TYPE)
    evidence.way = Evidence::Way::kTls;
  else if (security == kLocalSecurity)
    evidence.way = Evidence::Way::kSocket;
  evidence.certificate = property_of(connection, GRPC_X509_PEM_CERT_PROPERTY_NAME);
  const std::string_view authorization = value_of(metadata, "authorization");
  if (authorization.starts_with(kBearer)) evidence.token = authorization.substr(kBearer.size());
  return evidence;
}

class TurnsStrangersAway final : public grpc::AuthMetadataProcessor {
 public:
  TurnsStrangersAway(const Gatekeeper& gatekeeper, bool health) : gatekeeper_(gatekeeper), health_(health) {}

  bool IsBlocking() const override { return false; }
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* connection, OutputMetadata*,
                       OutputMetadata*) override {
    const std::string_view path = value_of(metadata, ":path");
    if (health_ && path.starts_with(kHealth)) return grpc::Status::OK;
    const auto identity = gatekeeper_.identify(evidence_of(metadata, *connection));
    if (identity.ok()) return grpc::Status::OK;
    spdlog::debug("{}: {}", path, identity.status().to_string());
    return {grpc::StatusCode::UNAUTHENTICATED, identity.status().message()};
  }

 private:
  const Gatekeeper& gatekeeper_;
  const bool health_;
};

}  // namespace

Evidence evidence_of(const grpc::CallbackServerContext& context, const grpc::AuthContext& connection) {
  return evidence_of(context.client_metadata(), connection);
}

std::shared_ptr<grpc::AuthMetadataProcessor> turn_strangers_away(const Gatekeeper& gatekeeper, bool health) {
  return std::make_shared<TurnsStrangersAway>(gatekeeper, health);
}

}  // namespace relmap::rpc
