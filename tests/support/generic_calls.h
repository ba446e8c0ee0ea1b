// Calls of gRPC by method name and bytes, without generated code: a client and a daemon of another release.
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace relmap::testing {

struct GenericReplies {
  std::vector<std::string> messages;
  grpc::Status status;  // CANCELLED if `most` messages came
};
// Sends the requests, and takes replies until the call ends or `most` came.
GenericReplies call_generic(const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                            const std::vector<std::string>& requests, std::size_t most);

// A server at a Unix socket that answers each call with one message.
class GenericServer {
 public:
  // The reply to a request; nullopt: UNIMPLEMENTED. Called by one thread.
  using Answer = std::function<std::optional<std::string>(const std::string& path, const std::string& request)>;
  GenericServer(const std::string& socket, Answer answer);
  ~GenericServer();

 private:
  void serve();

  struct Service;
  const Answer answer_;
  const std::unique_ptr<Service> service_;
  std::thread thread_;
};

}  // namespace relmap::testing
