#include "client/channel.h"

#include <grpcpp/channel.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include "proto/access/credentials.h"

namespace relmap::client {

Result<std::shared_ptr<grpc::Channel>> open_channel(const ServerAddress& where, const std::string& credentials,
                                                    const grpc::ChannelArguments& arguments) {
  if (where.is_socket() || credentials.empty())
    return grpc::CreateCustomChannel(where.address, grpc::InsecureChannelCredentials(), arguments);
  const auto shown = access::read_credentials(credentials);
  if (!shown.ok()) return shown.status();
  std::shared_ptr<grpc::ChannelCredentials> by =
      grpc::SslCredentials({shown->authorities, shown->key, shown->certificate});
  if (!shown->token.empty()) by = grpc::CompositeChannelCredentials(by, grpc::AccessTokenCredentials(shown->token));
  return grpc::CreateCustomChannel(where.address, by, arguments);
}

}  // namespace relmap::client
