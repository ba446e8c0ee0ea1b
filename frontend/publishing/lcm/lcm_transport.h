// Sends parts of keyframes and gaps over LCM, and receives acknowledgements and news.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "frontend/publishing/lcm/sealed_daemon.h"
#include "frontend/publishing/publish_transport.h"
#include "proto/base/mutex.h"
#include "proto/wire/lcm_link.h"

namespace relmap::publishing {

struct LcmTransportOptions {
  // With a key, all that is sent is sealed, and only what a daemon has sealed with it is heard. Until a daemon has said
  // welcome, what is sent is lost.
  std::optional<access::RobotKey> key = {};
};

class LcmTransport final : public PublishTransport {
 public:
  // Sends a message on a channel; thread-safe.
  using Publish = std::function<void(const char* channel, const Bytes& message)>;

  // INVALID_ARGUMENT, NO_MULTICAST_ROUTE, IO_ERROR.
  static Result<std::unique_ptr<LcmTransport>> open(const std::string& url, LcmTransportOptions options = {});
  // Over a link of the caller, who passes on what comes on heard_channels(), and stops doing so before stop(). `local`:
  // datagrams stay on this machine.
  LcmTransport(Publish publish, bool local, LcmTransportOptions options);
  ~LcmTransport() override { stop(); }

  static std::vector<const char*> heard_channels();
  // A datagram came. Thread-safe.
  void hear(std::string_view channel, ByteSpan datagram);

  // On one machine, as large as a datagram may be. Over a network a large datagram is split into IP fragments and lost
  // with any of them, so the usual part fits a packet.
  PartBytes part_bytes() const override;
  Status trouble() const override;
  void send(const KeyframePart& part) override;
  void send(const Gap& gap) override;
  void send(const SessionEnd& end) override;
  void sends_for(const SessionUuid& session, const Uuid& map) override;
  void listen(Listener listener) override;
  void stop() override;

 private:
  struct Opened {
    ByteSpan message;
    std::optional<access::Seal> seal;
  };
  std::optional<Opened> open(std::string_view channel, ByteSpan datagram) RELMAP_REQUIRES(mutex_);
  bool counts(const BootId& boot, const Opened& opened) RELMAP_REQUIRES(mutex_);
  // Passes a message to a function of the listener.
  template <typename Message>
  void tell(std::function<void(const Message&)> Listener::*heard, const Message& message);
  void transmit(const char* channel, Bytes message);
  void put_out(const char* channel, const Bytes& datagram);
  void keep_in_touch();

  using Time = std::chrono::steady_clock::time_point;

  const Publish publish_;
  const bool local_;
  Mutex listener_mutex_;  // the listener is called under it, and may hold locks of which others call this object
  Listener listener_ RELMAP_GUARDED_BY(listener_mutex_);
  mutable Mutex mutex_;
  ConditionVariable changed_;
  std::optional<SealedDaemon> daemon_ RELMAP_GUARDED_BY(mutex_);  // if there is a key
  SessionUuid session_ RELMAP_GUARDED_BY(mutex_);
  bool unsealed_heard_ RELMAP_GUARDED_BY(mutex_) = false;     // some daemon says which map it serves
  bool acknowledged_ RELMAP_GUARDED_BY(mutex_) = false;       // a daemon has answered to the session
  std::optional<Time> sent_since_ RELMAP_GUARDED_BY(mutex_);  // the first message
  std::optional<Time> hello_said_ RELMAP_GUARDED_BY(mutex_);
  bool hello_wanted_ RELMAP_GUARDED_BY(mutex_) = false;  // at once
  bool stopping_ RELMAP_GUARDED_BY(mutex_) = false;
  std::thread thread_;             // says hello; only with a key
  std::unique_ptr<LcmLink> link_;  // null over a link of the caller
};

}  // namespace relmap::publishing
