// Reads the events of a log that lcm-logger wrote. An event has the sync word 0xEDA1DA01, a number and a time (8 bytes
// each), the lengths of channel and data (4 bytes each), and channel and data; all big-endian. LCM's own reader trusts
// every length: one event of 2^31 - 1 bytes ends its process.
#pragma once

#include <algorithm>
#include <cstdint>
#include <istream>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::recording {

// True if the file begins with the sync word.
bool is_event_log(const std::string& path);

class EventLog {
 public:
  struct Event {
    std::string channel;
    std::uint64_t data_at = 0;  // position in the log
    std::uint32_t data_bytes = 0;
  };

  static Result<EventLog> open(const std::string& path);  // NO_SUCH_FILE
  // `name` is used in messages.
  EventLog(std::unique_ptr<std::istream> in, std::uint64_t bytes, std::string name);

  // Returns the next event; nothing at the end. Damage is skipped up to the next sync word. If the end is damaged,
  // returns once TRUNCATED (in the middle of an event), CORRUPT (no event) or IO_ERROR; the message gives the byte
  // offset.
  Result<std::optional<Event>> next();

  // The first 64 KiB of an event's data, more than any message of relmap has; valid until the next call of any
  // function.
  ByteSpan data(const Event& event) { return at(event.data_at, std::min(event.data_bytes, kMaxData)); }

  const std::string& name() const { return name_; }
  std::uint64_t damages() const { return damages_; }  // number of damaged stretches skipped since the beginning
  void rewind();

 private:
  static constexpr std::uint32_t kMaxData = 64 * 1024;
  bool is_buffered(std::uint64_t position, std::size_t bytes) const;
  std::size_t read(std::uint64_t position, std::span<std::uint8_t> bytes);
  // What the buffer holds from `position` on; it is refilled if that is less than `min_bytes`.
  ByteSpan from(std::uint64_t position, std::size_t min_bytes);
  ByteSpan at(std::uint64_t position, std::size_t bytes);
  bool begins_event(std::uint64_t position);
  std::uint64_t find_sync_word(std::uint64_t position);
  std::optional<Event> event_at(std::uint64_t position);
  std::optional<Event> take_event(std::uint64_t begin);

  std::unique_ptr<std::istream> in_;
  std::uint64_t bytes_;
  std::string name_;
  std::uint64_t position_ = 0;
  std::uint64_t damages_ = 0;
  bool failed_ = false;  // reading the disk failed
  Bytes buffer_;         // bytes of the log from buffered_at_ on
  std::uint64_t buffered_at_ = 0;
};

}  // namespace relmap::recording
