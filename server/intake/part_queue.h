// Parts that wait to be looked at, a queue a sender. Queues are served in turn by bytes, and where there is no room the
// longest gives way: who sends too much waits for himself, and loses by himself. (Deficit round robin, Shreedhar and
// Varghese 1995; longest queue drop, Suter et al. 1998.)
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

  // `sender`: whose queue; nil is one like any other.
  void push(const SessionUuid& sender, KeyframePart part);
  std::optional<KeyframePart> pop();

  bool empty() const { return turns_.empty(); }
  std::size_t bytes() const { return bytes_; }  // waiting, overhead included

  struct Facts {
    std::uint32_t waiting = 0;
    std::uint64_t dropped = 0;
  };
  Facts of(const SessionUuid& sender) const;
  // Forgets what was counted of senders that are not `known`.
  void keep_only(const std::set<SessionUuid>& known);

 private:
  struct Queue {
    std::deque<KeyframePart> parts;
    std::size_t bytes = 0;
    std::size_t deficit = 0;  // bytes that it may still send in this turn
    std::uint64_t dropped = 0;
    std::list<SessionUuid>::iterator turn;  // while it is not empty
  };
  void drop_last(Queue& queue);

  const std::size_t capacity_;
  std::size_t bytes_ = 0;
  std::map<SessionUuid, Queue> queues_;
  std::list<SessionUuid> turns_;  // of queues that are not empty; the first is being served
};

}  // namespace relmap::intake
