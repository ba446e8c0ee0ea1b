// Keyframes and gaps over the Ingest service; acknowledgements and news back.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>

#include "frontend/publishing/publish_transport.h"

namespace relmap::publishing {

struct GrpcTransportOptions {
  // To be written, at most, which is more than PublisherCore has under way; what does not fit is lost.
  std::size_t waiting_bytes = std::size_t{4} << 20;
  std::chrono::milliseconds silence{10'000};  // without an answer: another stream is tried
};

class GrpcTransport final : public PublishTransport {
 public:
  // `server`: a data folder or HOST:PORT, as client/server_address.h takes it; INVALID_ARGUMENT: it is neither. A
  // daemon that does not answer is waited for. `robot`: for display. Starts one thread.
  static Result<std::unique_ptr<GrpcTransport>> open(const std::string& server, const std::string& robot,
                                                     GrpcTransportOptions options = {});
  ~GrpcTransport() override;

  PartBytes part_bytes() const override;  // keyframes travel whole
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
