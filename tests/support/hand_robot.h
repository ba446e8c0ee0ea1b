// A robot whose messages are made by hand, valid or not. It sends parts and gaps over LCM, and hears the daemon's
// acknowledgements.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "proto/keyframe/ingest_messages.h"
#include "proto/keyframe/keyframe.h"
#include "proto/wire/lcm_link.h"

namespace relmap::testing {

class HandRobot {
 public:
  // Throws StatusError if LCM does not start.
  HandRobot(const std::string& lcm_url, const SessionUuid& session);

  // Sends a message once; LCM may lose it.
  void say(const KeyframePart& part);
  void say(const Gap& gap);
  void say_bytes(const char* channel, const Bytes& message);
  // Sends all parts of a payload except `left_out`.
  void say_payload(std::uint32_t sequence, const Bytes& payload, std::optional<std::uint32_t> left_out = {});

  // The newest acknowledgement of this session.
  std::optional<Acknowledgement> acknowledgement() const;

  // Repeats `what` until an acknowledgement satisfies `done`; false after 20 s.
  bool until(const std::function<void()>& what, const std::function<bool(const Acknowledgement&)>& done);
  // Sends a payload until it is settled.
  bool settle(std::uint32_t sequence, const Bytes& payload);
  // The reason for which the newest acknowledgement says that the sequence was refused.
  Reason refusal(std::uint32_t sequence) const;

  // The part `index` of a payload.
  KeyframePart part(std::uint32_t sequence, const Bytes& payload, std::uint32_t index) const;

 private:
  const SessionUuid session_;
  mutable std::mutex mutex_;
  std::optional<Acknowledgement> newest_;
  std::unique_ptr<LcmLink> link_;
};

// Repeats `what` until `done` or 20 s have passed; returns done().
bool repeat_until(const std::function<void()>& what, const std::function<bool()>& done);

}  // namespace relmap::testing
