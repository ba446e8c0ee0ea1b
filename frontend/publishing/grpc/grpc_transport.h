// Sends keyframes and gaps over the Ingest service, and receives acknowledgements and news.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>

#include "frontend/publishing/publish_transport.h"

namespace relmap::publishing {

struct GrpcTransportOptions {
  // Maximum size of the queue, which exceeds what PublisherCore has in flight. Messages that do not fit are dropped.
  std::size_t waiting_bytes = std::size_t{4} << 20;
  std::chrono::milliseconds silence{10'000};  // after this time without an answer another stream is opened
  std::string credentials = {};               // file, as ClientOptions has it
};

class GrpcTransport final : public PublishTransport {
 public:
  // Starts one thread, which waits for a daemon that does not answer. `server` is a data folder or HOST:PORT
  // (client/server_address.h); INVALID_ARGUMENT if it is neither. `robot` must be that of the credentials, if they are
  // a robot's. NO_SUCH_FILE, BAD_CONFIG: the credentials cannot be used.
  static Result<std::unique_ptr<GrpcTransport>> open(const std::string& server, const std::string& robot,
                                                     GrpcTransportOptions options = {});
  ~GrpcTransport() override;

  PartBytes part_bytes() const override;  // a keyframe is one part
  bool lossless() const override { return true; }
  Status trouble() const override;
  void send(const KeyframePart& part) override;
  void send(const Gap& gap) override;
  void send(const SessionEnd& end) override;
  void listen(Listener listener) override;
  void stop() override;

 private:
  struct Impl;
  explicit GrpcTransport(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::publishing
