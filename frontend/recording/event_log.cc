#include "frontend/recording/event_log.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <utility>

#include "proto/base/big_endian.h"

namespace relmap::recording {

namespace {

constexpr std::array<std::uint8_t, 4> kSyncWord = {0xed, 0xa1, 0xda, 0x01};
constexpr std::size_t kHeaderBytes = 28;
constexpr std::uint32_t kMaxChannel = 999, kMaxLength = 0x7fffffff;  // as LCM
constexpr std::size_t kBufferBytes = std::size_t{256} << 10;

}  // namespace

bool is_event_log(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  std::ifstream in(path, std::ios::binary);
  std::array<std::uint8_t, kSyncWord.size()> begin{};
  in.read(reinterpret_cast<char*>(begin.data()), begin.size());
  return in && begin == kSyncWord;
}

Result<EventLog> EventLog::open(const std::string& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  auto in = std::make_unique<std::ifstream>(path, std::ios::binary);
  if (error || !*in) return {Reason::NO_SUCH_FILE, path + " cannot be opened"};
  return EventLog(std::move(in), bytes, path);
}

EventLog::EventLog(std::unique_ptr<std::istream> in, std::uint64_t bytes, std::string name)
    : in_(std::move(in)), bytes_(bytes), name_(std::move(name)) {}

void EventLog::rewind() {
  position_ = damages_ = 0;
  failed_ = false;
}

bool EventLog::is_buffered(std::uint64_t position, std::size_t bytes) const {
  return position >= buffered_at_ && position + bytes <= buffered_at_ + buffer_.size();
}

std::size_t EventLog::read(std::uint64_t position, std::span<std::uint8_t> bytes) {
  in_->clear();
  in_->seekg(static_cast<std::streamoff>(position));
  in_->read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const auto got = static_cast<std::size_t>(in_->gcount());
  failed_ = failed_ || got < bytes.size();
  return got;
}

ByteSpan EventLog::from(std::uint64_t position, std::size_t min_bytes) {
  const std::uint64_t left = bytes_ - std::min(position, bytes_);
  if (!is_buffered(position, static_cast<std::size_t>(std::min<std::uint64_t>(min_bytes, left)))) {
    buffer_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kBufferBytes, left)));
    buffer_.resize(read(position, buffer_));
    buffered_at_ = position;
  }
  return ByteSpan(buffer_).subspan(static_cast<std::size_t>(position - buffered_at_));
}

ByteSpan EventLog::at(std::uint64_t position, std::size_t bytes) {
  const ByteSpan rest = from(position, bytes);
  return rest.first(std::min(bytes, rest.size()));
}

// Whether a sync word is at a position, or as much of one as the log has left. The position may come from a false
// length and be far away, so the buffer is not refilled there: otherwise every false length would cost a read.
bool EventLog::begins_event(std::uint64_t position) {
  std::array<std::uint8_t, kSyncWord.size()> word{};
  const auto left = static_cast<std::size_t>(std::min<std::uint64_t>(word.size(), bytes_ - std::min(position, bytes_)));
  if (left == 0) return false;
  if (is_buffered(position, left))
    std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(position - buffered_at_), left, word.begin());
  else if (read(position, std::span(word).first(left)) < left)
    return false;
  return std::equal(word.begin(), word.begin() + static_cast<std::ptrdiff_t>(left), kSyncWord.begin());
}

std::uint64_t EventLog::find_sync_word(std::uint64_t position) {
  while (position < bytes_ && !begins_event(position)) {
    const ByteSpan stretch = from(position, 1);
    if (stretch.empty()) return bytes_;
    const auto first = std::find(stretch.begin() + 1, stretch.end(), kSyncWord[0]);
    position += static_cast<std::uint64_t>(first - stretch.begin());
  }
  return position;
}

std::optional<EventLog::Event> EventLog::event_at(std::uint64_t position) {
  const ByteSpan header = at(position, kHeaderBytes);
  if (header.size() < kHeaderBytes) return std::nullopt;
  const std::uint32_t channel_bytes = big_endian(header.subspan(20, 4));
  const std::uint32_t data_bytes = big_endian(header.subspan(24, 4));
  if (channel_bytes == 0 || channel_bytes > kMaxChannel || data_bytes > kMaxLength) return std::nullopt;
  Event event{{}, position + kHeaderBytes + channel_bytes, data_bytes};
  if (event.data_at + data_bytes > bytes_) return std::nullopt;
  const ByteSpan channel = at(position + kHeaderBytes, channel_bytes);
  event.channel.assign(channel.begin(), channel.end());
  return event;
}

std::optional<EventLog::Event> EventLog::take_event(std::uint64_t begin) {
  auto event = event_at(begin);
  if (!event) return std::nullopt;
  const std::uint64_t end = event->data_at + event->data_bytes;
  position_ = end;
  if (end == bytes_ || begins_event(end)) return event;
  // No event follows at its end, so its lengths may be wrong and hide other events.
  if (const std::uint64_t hidden = find_sync_word(begin + kSyncWord.size()); hidden < end) {
    position_ = hidden;
    ++damages_;
  }
  return event;
}

Result<std::optional<EventLog::Event>> EventLog::next() {
  while (position_ < bytes_) {
    const std::uint64_t begin = position_;
    const auto refuse = [&](Reason reason, const char* what) -> Status {
      position_ = bytes_;
      return {reason, name_ + ", byte " + std::to_string(begin) + ": " + what};
    };
    const bool begun = begins_event(begin);
    if (begun)
      if (auto event = take_event(begin); event && !failed_) return event;
    position_ = find_sync_word(begin + 1);
    if (failed_) return refuse(Reason::IO_ERROR, "cannot be read");
    if (position_ == bytes_ && begun) return refuse(Reason::TRUNCATED, "ends within an event");
    if (position_ == bytes_) return refuse(Reason::CORRUPT, "no event of an LCM log");
    ++damages_;
  }
  return std::optional<Event>();
}

}  // namespace relmap::recording
