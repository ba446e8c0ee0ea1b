// Writes logs as lcm-logger does, with LCM's own functions.
#pragma once

#include <lcm/lcm.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/crc32c.h"
#include "proto/keyframe/ingest_messages.h"
#include "proto/keyframe/keyframe.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"

namespace relmap::recording {

// Channel and bytes of a recorded message.
using Message = std::pair<std::string, Bytes>;

inline Message to_message(const KeyframePart& part) { return {kKeyframeChannel, encode_lcm(part)}; }
inline Message to_message(const Gap& gap) { return {kGapChannel, encode_lcm(gap)}; }

// The messages of a keyframe, in the order of its parts.
inline std::vector<Message> to_messages(const Keyframe& keyframe, std::uint32_t part_bytes = kNetworkPartBytes) {
  const Bytes payload = encode_keyframe(keyframe);
  std::vector<Message> messages;
  for (std::uint32_t i = 0; i < count_parts(payload.size(), part_bytes); ++i)
    messages.push_back(
        to_message(cut_part(keyframe.session.uuid, keyframe.sequence, payload, crc32c(payload), part_bytes, i)));
  return messages;
}

class LogWriter {
 public:
  explicit LogWriter(const std::string& path) : log_(lcm_eventlog_create(path.c_str(), "w"), lcm_eventlog_destroy) {}

  void write(Message message) {
    lcm_eventlog_event_t event{};
    event.timestamp = ++time_us_;
    event.channellen = static_cast<std::int32_t>(message.first.size());
    event.channel = message.first.data();
    event.datalen = static_cast<std::int32_t>(message.second.size());
    event.data = message.second.data();
    lcm_eventlog_write_event(log_.get(), &event);
  }
  void write(const std::vector<Message>& messages) {
    for (const Message& message : messages) write(message);
  }

 private:
  std::unique_ptr<lcm_eventlog_t, void (*)(lcm_eventlog_t*)> log_;
  std::int64_t time_us_ = 1'700'000'000'000'000;
};

}  // namespace relmap::recording
