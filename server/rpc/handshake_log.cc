#include "server/rpc/handshake_log.h"

#include <grpc/support/log.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

#include "proto/base/mutex.h"

namespace relmap::rpc {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::minutes kSpacing{1};
constexpr std::string_view kFailed = "Security handshake failed: UNKNOWN:";

constexpr std::string_view kAssertion = "assertion failed";

// What stands between `begin` and the next `end`; empty if there is no `begin`.
std::string_view between(std::string_view text, std::string_view begin, char end) {
  const std::size_t at = text.find(begin);
  return at == text.npos ? "" : text.substr(at + begin.size(), text.find(end, at + begin.size()) - at - begin.size());
}

// gRPC's text is "WHAT {details, children:[CODE:WHY {details, target_address:"FROM"}]}", or without children.
std::string in_short(std::string_view text) {
  std::string what(between(text, kFailed, '{'));
  const std::string_view why = between(text, "children:[", '{'), from = between(text, "target_address:\"", '"');
  while (what.ends_with(' ')) what.pop_back();
  if (!why.empty()) what += ": " + std::string(why.substr(why.find(':') + 1));
  while (what.ends_with(' ')) what.pop_back();
  return from.empty() ? what : what + ", " + std::string(from);
}

class HandshakeLog {
 public:
  void note(const std::string& what) {
    const MutexLock lock(mutex_);
    const auto now = Clock::now();
    if (told_ && now - *told_ < kSpacing) {
      ++untold_;
      return;
    }
    spdlog::warn(
        "TLS: a handshake failed ({}): the caller's certificate has expired or is another authority's, or the caller "
        "does not believe this daemon's, or speaks no TLS{}",
        what, untold_ == 0 ? "" : "; and " + std::to_string(untold_) + " more since the last such line");
    told_ = now;
    untold_ = 0;
  }

 private:
  Mutex mutex_;
  std::optional<Clock::time_point> told_ RELMAP_GUARDED_BY(mutex_);
  std::uint64_t untold_ RELMAP_GUARDED_BY(mutex_) = 0;
};

void hear(gpr_log_func_args* said) {
  static HandshakeLog log;
  const std::string_view text = said->message;
  if (text.starts_with(kFailed)) log.note(in_short(text));
  if (text.starts_with(kAssertion)) spdlog::critical("INTERNAL: gRPC: {}", text);  // and ends the process
}

}  // namespace

void log_failed_handshakes() {
  const char* const asked = std::getenv("GRPC_VERBOSITY");
  if (asked && asked != std::string_view("NONE")) return;
  gpr_set_log_function(hear);
  gpr_set_log_verbosity(GPR_LOG_SEVERITY_DEBUG);
}

}  // namespace relmap::rpc
