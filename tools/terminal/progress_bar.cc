#include "tools/terminal/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <ostream>
#include <string_view>

#include "proto/base/bar_text.h"
#include "tools/terminal/console.h"

namespace relmap::terminal {

namespace {

constexpr std::chrono::milliseconds kRedraw{100}, kNextLine{2000};

std::string amount_text(std::uint64_t done, std::uint64_t total, const std::string& unit) {
  const auto text = [&](std::uint64_t n) { return unit == "bytes" ? bytes_text(n) : std::to_string(n); };
  if (done == 0 && total == 0) return "";
  return text(done) + (total > 0 ? " of " + text(total) : "") + (unit == "bytes" ? "" : " " + unit);
}

}  // namespace

void ProgressBar::show(const std::string& step, std::uint64_t done, std::uint64_t total, const std::string& unit) {
  if (step.empty()) return;
  const auto now = Clock::now();
  const bool fresh = step != step_;
  if (fresh) {
    step_ = step;
    begun_ = now;
    tenths_ = 0;
    complete_ = false;
  }
  const std::uint64_t tenths = total > 0 ? std::min(done, total) * 10 / total : 0;
  const auto since = now - shown_;
  const bool completes = total > 0 && done >= total && !complete_;
  if (!fresh && !completes && (terminal_ ? since < kRedraw : since < kNextLine || tenths == tenths_)) return;
  shown_ = now;
  tenths_ = tenths;
  complete_ = total > 0 && done >= total;
  const std::string amount = amount_text(done, total, unit);
  if (terminal_)
    draw(amount, done, total);
  else
    err_ << step << (amount.empty() ? "" : ": " + amount) << '\n' << std::flush;
}

void ProgressBar::draw(const std::string& amount, std::uint64_t done, std::uint64_t total) {
  constexpr std::uint64_t kWidth = 32;
  std::string line = step_;
  if (total > 0) {
    const double part = static_cast<double>(std::min(done, total)) / static_cast<double>(total);
    line += ' ' + progress_bar_text(done, total, kWidth);
    const double seconds = std::chrono::duration<double>(Clock::now() - begun_).count();
    line += "  " + amount;
    if (part > 0.01 && part < 1 && seconds > 2) line += "  " + duration_text(seconds * (1 - part) / part) + " left";
  } else {
    line +=
        "  " + (amount.empty() ? duration_text(std::chrono::duration<double>(Clock::now() - begun_).count()) : amount);
  }
  err_ << '\r' << line << " \x1b[K" << std::flush;
  visible_ = true;
}

void ProgressBar::end() {
  if (visible_) err_ << "\r\x1b[K" << std::flush;
  visible_ = false;
}

bool is_terminal() {
  const char* kind = std::getenv("TERM");
  return isatty(STDERR_FILENO) != 0 && kind && std::string_view(kind) != "dumb";
}

}  // namespace relmap::terminal
