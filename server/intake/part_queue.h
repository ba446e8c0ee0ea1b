// Parts that wait to be taken in, in one queue per sender. Queues are served in turn by bytes; when there is no room,
// the longest queue loses its last part. So a sender that sends too much delays and loses only its own parts. (Deficit
// round robin, Shreedhar and Varghese 1995; longest queue drop, Suter et al. 1998.)
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <optional>
#include <set>

#include "proto/keyframe/ingest_messages.h"

namespace relmap::intake {

class PartQueue {
 public:
  explicit PartQueue(std::size_t capacity_bytes) : capacity_(capacity_bytes) {}

  // Adds a part to its sender's queue, or drops it if that queue would become the longest. A nil `sender` is a sender
  // like any other.
  void push(const SessionUuid& sender, KeyframePart part);
  // The next part; nullopt if all queues are empty.
  std::optional<KeyframePart> pop();

  bool empty() const { return turns_.empty(); }
  std::size_t bytes() const { return bytes_; }  // waiting, overhead included

  struct Facts {
    std::uint32_t waiting = 0;
    std::uint64_t dropped = 0;
  };
  Facts of(const SessionUuid& sender) const;
  // Forgets the counts of senders that are not `known` and have nothing waiting.
  void keep_only(const std::set<SessionUuid>& known);

 private:
  struct Queue {
    std::deque<KeyframePart> parts;
    std::size_t bytes = 0;
    std::size_t deficit = 0;  // bytes that it may still send in this turn
    std::uint64_t dropped = 0;
    std::list<SessionUuid>::iterator turn;  // valid while the queue is not empty
  };
  void drop_last(Queue& queue);

  const std::size_t capacity_;
  std::size_t bytes_ = 0;
  std::map<SessionUuid, Queue> queues_;
  std::list<SessionUuid> turns_;  // senders with non-empty queues; the first is being served
};

}  // namespace relmap::intake
