#include "client/channel.h"

#include <grpcpp/channel.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include "proto/access/access_list.h"
#include "proto/access/certificate.h"
#include "proto/access/credentials.h"
#include "proto/base/clock.h"

namespace relmap::client {

namespace {

constexpr int kMaxReplyBytes = 16 << 20;

std::shared_ptr<grpc::ChannelCredentials> with_token(std::shared_ptr<grpc::ChannelCredentials> by,
                                                     const std::string& token) {
  return token.empty() ? by : grpc::CompositeChannelCredentials(by, grpc::AccessTokenCredentials(token));
}

}  // namespace

grpc::ChannelArguments usual_channel_arguments() {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxReplyBytes);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // gRPC shares connections between channels. The one of an older client may lead to a daemon that was killed, and look
  // connected until somebody writes to it.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // Reconnects soon after a daemon was restarted.
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 1000);
  return arguments;
}

std::shared_ptr<grpc::Channel> open_channel_for_tokens(const ServerAddress& where, const std::string& authorities,
                                                       const grpc::ChannelArguments& arguments,
                                                       const std::string& token) {
  if (where.is_socket() || authorities.empty())
    return grpc::CreateCustomChannel(where.address, grpc::InsecureChannelCredentials(), arguments);
  return grpc::CreateCustomChannel(where.address, with_token(grpc::SslCredentials({authorities, "", ""}), token),
                                   arguments);
}

Result<std::shared_ptr<grpc::Channel>> open_channel(const ServerAddress& where, const std::string& credentials,
                                                    const grpc::ChannelArguments& arguments) {
  if (where.is_socket() || credentials.empty())
    return grpc::CreateCustomChannel(where.address, grpc::InsecureChannelCredentials(), arguments);
  const auto shown = access::read_credentials(credentials);
  if (!shown.ok()) return shown.status();
  return grpc::CreateCustomChannel(
      where.address,
      with_token(grpc::SslCredentials({shown->authorities, shown->key, shown->certificate}), shown->token), arguments);
}

std::string other_causes(const ServerAddress& where, const std::string& credentials, const std::string& why) {
  if (where.is_socket()) return "";
  if (credentials.empty()) return ", or it serves TLS, and needs --credentials";
  std::string causes = ", or it and " + credentials + " do not trust each other";
  if (const auto shown = access::read_credentials(credentials); shown.ok())
    if (const auto facts = access::read_certificate(shown->certificate);
        facts.ok() && facts->expires_s <= now_us() / 1'000'000)
      causes += " (its certificate expired at " + access::time_text(facts->expires_s) + ")";
  if (why.find("is not in peer certificate") != std::string::npos)
    causes += " (relmap-admin credentials ca FOLDER --host HOST adds a name or an address to the daemon's certificate)";
  return causes;
}

}  // namespace relmap::client
