// Opens gRPC channels to a daemon.
#pragma once

#include <memory>
#include <string>

#include "client/server_address.h"

namespace grpc {
class Channel;
class ChannelArguments;
}  // namespace grpc

namespace relmap::client {

// Over TCP with TLS if `credentials` names a file (proto/access/credentials.h), which proves who the caller is; without
// TLS if it is empty. A Unix socket needs neither. NO_SUCH_FILE, BAD_CONFIG: the file cannot be used.
Result<std::shared_ptr<grpc::Channel>> open_channel(const ServerAddress& where, const std::string& credentials,
                                                    const grpc::ChannelArguments& arguments);

// The same for a daemon that serves TLS, for callers who show a token with each call or nothing: `authorities` (PEM)
// may have issued the daemon's certificate. Empty: without TLS. `token`: shown with each call; empty: none.
std::shared_ptr<grpc::Channel> open_channel_for_tokens(const ServerAddress& where, const std::string& authorities,
                                                       const grpc::ChannelArguments& arguments,
                                                       const std::string& token = "");

// The arguments of every channel to a daemon: how large its messages may be, and how soon one that was restarted is
// found again.
grpc::ChannelArguments usual_channel_arguments();

// What else may be the cause where nothing answers at this address, and what to do about it: ", or it serves TLS, and
// needs --credentials". `why` is what gRPC says. Empty at a Unix socket.
std::string other_causes(const ServerAddress& where, const std::string& credentials, const std::string& why);

}  // namespace relmap::client
