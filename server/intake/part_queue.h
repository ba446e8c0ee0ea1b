// Parts that wait to be taken in, in one queue for each party. Queues are served in turn by bytes; when there is no
// room, the longest queue loses its last part. So one that sends too much delays and loses only its own parts. (Deficit
// round robin, Shreedhar and Varghese 1995; longest queue drop, Suter et al. 1998.)
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>

#include "proto/keyframe/ingest_messages.h"
#include "server/intake/sender.h"

namespace relmap::intake {

class PartQueue {
 public:
  explicit PartQueue(std::size_t capacity_bytes) : capacity_(capacity_bytes) {}

  struct Sent {
    KeyframePart part;
    Sender sender;
  };

  // Adds a part to its queue, or drops it if that queue would become the longest.
  void push(const Party& party, Sent sent);
  // The next part; nullopt if all queues are empty.
  std::optional<Sent> pop();

  bool empty() const { return turns_.empty(); }
  std::size_t bytes() const { return bytes_; }  // waiting, overhead included

  struct Facts {
    std::uint32_t waiting = 0;
    std::uint64_t dropped = 0;
  };
  Facts of(const Party& party) const;
  // Forgets the counts of parties of which `is_known` is false and that have nothing waiting.
  void keep_only(const std::function<bool(const Party&)>& is_known);

 private:
  struct Queue {
    std::deque<Sent> parts;
    std::size_t bytes = 0;
    std::size_t deficit = 0;  // bytes that it may still send in this turn
    std::uint64_t dropped = 0;
    std::list<Party>::iterator turn;  // valid while the queue is not empty
  };
  void drop_last(Queue& queue);

  const std::size_t capacity_;
  std::size_t bytes_ = 0;
  std::map<Party, Queue> queues_;
  std::list<Party> turns_;  // those with non-empty queues; the first is being served
};

}  // namespace relmap::intake
