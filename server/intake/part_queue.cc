#include "server/intake/part_queue.h"

#include <algorithm>
#include <utility>

namespace relmap::intake {

namespace {
constexpr std::size_t kTurnBytes = 16 * 1024;
std::size_t cost(const PartQueue::Sent& sent) { return sizeof sent + sent.part.data.size(); }
}  // namespace

void PartQueue::drop_last(Queue& queue) {
  const std::size_t freed = cost(queue.parts.back());
  queue.parts.pop_back();
  queue.bytes -= freed;
  bytes_ -= freed;
  ++queue.dropped;
  if (queue.parts.empty()) turns_.erase(queue.turn);
}

void PartQueue::push(const Party& party, Sent sent) {
  Queue& queue = queues_[party];
  const std::size_t bytes = cost(sent);
  while (bytes_ + bytes > capacity_) {
    const auto longest = std::max_element(queues_.begin(), queues_.end(),
                                          [](const auto& a, const auto& b) { return a.second.bytes < b.second.bytes; });
    if (longest->second.bytes <= queue.bytes + bytes) {
      ++queue.dropped;
      return;
    }
    drop_last(longest->second);
  }
  if (queue.parts.empty()) {
    queue.turn = turns_.insert(turns_.end(), party);
    queue.deficit = 0;
  }
  queue.parts.push_back(std::move(sent));
  queue.bytes += bytes;
  bytes_ += bytes;
}

std::optional<PartQueue::Sent> PartQueue::pop() {
  if (turns_.empty()) return std::nullopt;
  for (;;) {
    Queue& queue = queues_.find(turns_.front())->second;
    const std::size_t bytes = cost(queue.parts.front());
    if (queue.deficit < bytes) {
      queue.deficit += kTurnBytes;
      turns_.splice(turns_.end(), turns_, queue.turn);
      continue;
    }
    queue.deficit -= bytes;
    Sent sent = std::move(queue.parts.front());
    queue.parts.pop_front();
    queue.bytes -= bytes;
    bytes_ -= bytes;
    if (queue.parts.empty()) turns_.erase(queue.turn);
    return sent;
  }
}

PartQueue::Facts PartQueue::of(const Party& party) const {
  const auto found = queues_.find(party);
  if (found == queues_.end()) return {};
  return {static_cast<std::uint32_t>(found->second.parts.size()), found->second.dropped};
}

void PartQueue::keep_only(const std::function<bool(const Party&)>& is_known) {
  std::erase_if(queues_, [&](const auto& entry) { return entry.second.parts.empty() && !is_known(entry.first); });
}

}  // namespace relmap::intake
