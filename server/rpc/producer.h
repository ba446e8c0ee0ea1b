// Functions that produce the messages of a stream, one after another.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <utility>
#include <variant>

#include "proto/base/status.h"

namespace relmap::rpc {

// Returns nullopt after the last message. Called by one thread at a time.
template <typename Reply>
using Producer = std::function<Result<std::optional<Reply>>()>;

// A stream has nothing to send now. It is asked again once it is woken, and at `until` at the latest; `until` in the
// past lets others have a turn first.
struct Waiting {
  std::chrono::steady_clock::time_point until;
};
// nullopt after the last message.
template <typename Reply>
using Next = std::optional<std::variant<Reply, Waiting>>;

// Makes a stream that waits be asked again. It may be called by any thread, also while the stream is being asked, until
// the producer is destroyed; it returns at once.
using Wake = std::function<void()>;

// The producer of a stream that waits, without holding a thread meanwhile. Called by one thread at a time.
template <typename Reply>
using LiveProducer = std::function<Result<Next<Reply>>(const Wake& wake)>;

template <typename Reply>
LiveProducer<Reply> live(LiveProducer<Reply> producer) {
  return producer;
}
// A producer that always has something to say.
template <typename Reply>
LiveProducer<Reply> live(Producer<Reply> producer) {
  return [producer = std::move(producer)](const Wake&) -> Result<Next<Reply>> {
    auto message = producer();
    if (!message.ok()) return message.status();
    if (!message->has_value()) return Next<Reply>();
    return Next<Reply>(std::move(**message));
  };
}

}  // namespace relmap::rpc
