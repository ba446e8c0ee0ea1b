#include "server/monitor/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <utility>

#include "proto/base/json.h"
#include "proto/base/printf_text.h"
#include "proto/base/time_text.h"
#include "server/monitor/last_words.h"
#include "server/rpc/request_context.h"

namespace relmap::monitor {

namespace {

using Level = spdlog::level::level_enum;

struct Counters {
  std::atomic<std::uint64_t> warnings = 0, errors = 0, criticals = 0;
};
Counters& counters() {
  static Counters counted;
  return counted;
}

class CountingSink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (message.level == Level::warn) ++counters().warnings;
    if (message.level == Level::err) ++counters().errors;
    if (message.level == Level::critical) ++counters().criticals;
  }
  void flush_() override {}
};

// As syslog(3) numbers them.
int priority_of(Level level) {
  switch (level) {
    case Level::critical:
      return 2;
    case Level::err:
      return 3;
    case Level::warn:
      return 4;
    case Level::info:
      return 6;
    default:
      return 7;
  }
}

std::string_view view(spdlog::string_view_t text) { return {text.data(), text.size()}; }

// The message on one line: a name that somebody chose cannot look like another event.
std::string on_one_line(std::string_view message) {
  std::string line;
  for (const char c : message) {
    if (c == '\n')
      line += "\\n";
    else if (static_cast<unsigned char>(c) < ' ' || c == '\x7f')
      line += printf_text("\\x%02x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      line += c;
  }
  return line;
}

std::string with_request(const spdlog::details::log_msg& message) {
  const rpc::RequestContext* request = rpc::current_request();
  return (request ? "[" + request->request_id + "] " : std::string()) + on_one_line(view(message.payload));
}

// The message in the text format. What people read in passing is not cluttered by the request's id; what they look into
// has it.
class MessageFlag final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string line = message.level == Level::info ? on_one_line(view(message.payload)) : with_request(message);
    out.append(line.data(), line.data() + line.size());
  }
  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override { return std::make_unique<MessageFlag>(); }
};

class LineFormatter : public spdlog::formatter {
 public:
  using Line = std::string (*)(const spdlog::details::log_msg&);
  explicit LineFormatter(Line line) : line_(line) {}
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    const std::string line = line_(message) + "\n";
    out.append(line.data(), line.data() + line.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<LineFormatter>(line_); }

 private:
  const Line line_;
};

std::string json_line(const spdlog::details::log_msg& message) {
  const auto since = message.time.time_since_epoch();
  Json line;
  line.add("time", time_text(std::chrono::duration_cast<std::chrono::microseconds>(since).count()))
      .add("level", view(spdlog::level::to_string_view(message.level)))
      .add("message", view(message.payload));
  if (const rpc::RequestContext* request = rpc::current_request()) {
    line.add("request_id", request->request_id);
    if (!request->traceparent.empty()) line.add("trace_id", request->trace_id());
  }
  return line.text();
}

std::string journal_line(const spdlog::details::log_msg& message) {
  return "<" + std::to_string(priority_of(message.level)) + ">" + with_request(message);
}

// systemd names the device and inode of what it connected to standard error (systemd.exec(5)).
bool leads_to_journal() {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  struct stat file {};
  if (!stream || fstat(STDERR_FILENO, &file) != 0) return false;
  return std::to_string(file.st_dev) + ":" + std::to_string(file.st_ino) == stream;
}

}  // namespace

const std::vector<std::string>& log_formats() {
  static const std::vector<std::string> formats{"auto", "text", "json", "journal"};
  return formats;
}

void set_up_log(const std::string& format) {
  const bool journal = format == "journal" || (format == "auto" && leads_to_journal());
  const bool json = format == "json";
  std::shared_ptr<spdlog::sinks::sink> lines;
  if (json || journal) {
    lines = std::make_shared<spdlog::sinks::stderr_sink_mt>();
    lines->set_formatter(std::make_unique<LineFormatter>(json ? json_line : journal_line));
  } else {
    lines = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
    auto pattern = std::make_unique<spdlog::pattern_formatter>();
    pattern->add_flag<MessageFlag>('*').set_pattern("[%Y-%m-%d %H:%M:%S.%e] [%n] [%^%l%$] %*");
    lines->set_formatter(std::move(pattern));
  }
  say_last_words_as(json ? LastWords::kJson : journal ? LastWords::kJournal : LastWords::kText);
  const spdlog::sinks_init_list sinks{lines, std::make_shared<CountingSink>()};
  const Level level = spdlog::get_level();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("relmapd", sinks));
  spdlog::set_level(level);
}

LogCounts log_counts() { return {counters().warnings, counters().errors, counters().criticals}; }

}  // namespace relmap::monitor
