#include "proto/wire/lcm_link.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <lcm/lcm-cpp.hpp>
#include <thread>

#include "proto/wire/lcm_url.h"

namespace relmap {

namespace {
// LCM limits its queue by the number of messages, of up to 64 KiB each. Its default of 30 is soon exceeded.
constexpr std::size_t kMessageBytes = 64 * 1024;
constexpr std::size_t kMinMessages = 30, kMaxMessages = 1000;
}  // namespace

struct LcmLink::Impl {
  struct Channel {
    std::string name;
    Handler handler;
    void receive(const lcm::ReceiveBuffer* buffer, const std::string&) {
      handler({static_cast<const std::uint8_t*>(buffer->data), buffer->data_size});
    }
  };

  Impl(const std::string& url, bool replays, Handlers handlers, std::size_t queue_bytes)
      : lcm(url),
        replay(replays),
        queue_messages(static_cast<int>(std::clamp(queue_bytes / kMessageBytes, kMinMessages, kMaxMessages))) {
    for (auto& [name, handler] : handlers) channels.push_back({name, std::move(handler)});
    stop_event = ::eventfd(0, EFD_CLOEXEC);
  }
  ~Impl() { ::close(stop_event); }

  bool subscribe() {
    if (!lcm.good() || stop_event < 0) return false;
    for (Channel& channel : channels) {
      lcm::Subscription* subscription = lcm.subscribe(channel.name, &Channel::receive, &channel);
      if (!subscription) return false;
      subscription->setQueueCapacity(queue_messages);
    }
    return true;
  }

  void run() {
    pollfd files[2] = {{lcm.getFileno(), POLLIN, 0}, {stop_event, POLLIN, 0}};
    for (;;) {
      if (::poll(files, 2, -1) < 0) continue;  // EINTR
      if (files[1].revents != 0) return;
      if (lcm.handle() < 0) break;
    }
    ended = true;
  }

  lcm::LCM lcm;
  const bool replay;
  const int queue_messages;
  std::vector<Channel> channels;
  int stop_event = -1;
  std::atomic<bool> ended = false;
  std::thread thread;
};

LcmLink::LcmLink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<LcmLink>> LcmLink::open(const std::string& url, Handlers handlers, std::size_t queue_bytes) {
  const Result<std::string> complete = complete_lcm_url(url);
  if (!complete.ok()) return complete.status();
  if (Status s = probe_multicast(*complete); !s.ok()) return s;
  auto impl = std::make_unique<Impl>(*complete, is_replay(*complete), std::move(handlers), queue_bytes);
  if (!impl->subscribe()) return {Reason::IO_ERROR, "LCM cannot open " + *complete};
  std::unique_ptr<LcmLink> link(new LcmLink(std::move(impl)));
  link->impl_->thread = std::thread([running = link->impl_.get()] { running->run(); });
  return link;
}

LcmLink::~LcmLink() { stop(); }

void LcmLink::publish(const char* channel, const Bytes& message) {
  if (impl_->replay) return;
  impl_->lcm.publish(channel, message.data(), static_cast<unsigned>(message.size()));
}

bool LcmLink::at_end() const { return impl_->ended; }

void LcmLink::stop() {
  if (!impl_->thread.joinable()) return;
  const std::uint64_t one = 1;
  while (::write(impl_->stop_event, &one, sizeof one) < 0) {
  }
  impl_->thread.join();
}

}  // namespace relmap
