// relmap top: the state of the daemon and its robots, refreshed once a second.
#include <unistd.h>

#include <memory>
#include <ostream>
#include <sstream>
#include <thread>

#include "tools/relmap/commands.h"
#include "tools/relmap/top_view.h"
#include "tools/terminal/interrupt.h"

namespace relmap::cli {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kPause{1};  // after a request that failed
constexpr char kHome[] = "\x1b[H\x1b[J";   // moves the cursor to the upper left corner, and clears the screen

struct TopOptions {
  double interval_s = 1;
  std::uint64_t count = 0;  // 0: until interrupted
  TopLimits limits;
};

Result<TopMoment> look(client::Client& client) {
  TopMoment moment;
  moment.at = Clock::now();
  auto status = client.status();
  if (!status.ok()) return status.status();
  auto robots = client.robots();
  if (!robots.ok()) return robots.status();
  auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  moment.status = std::move(*status);
  moment.robots = std::move(*robots);
  moment.sessions = std::move(*sessions);
  return moment;
}

// Sleeps until `end`, or until an interrupt.
void sleep_until(Clock::time_point end) {
  while (Clock::now() < end && !terminal::interrupted())
    std::this_thread::sleep_for(std::min<Clock::duration>(end - Clock::now(), std::chrono::milliseconds(50)));
}

Status run(const TopOptions& options, client::Client& client, terminal::Console& console) {
  terminal::watch_interrupts();
  const bool terminal = !console.json && isatty(STDOUT_FILENO) != 0;
  std::optional<TopMoment> before;
  auto next = Clock::now();
  for (std::uint64_t shown = 0; !terminal::interrupted(); ++shown) {
    auto now = look(client);
    if (!now.ok() && options.count > 0) return now.status();
    if (!now.ok()) {  // it may be back in a moment
      console.report(now.status());
      before.reset();
      next = Clock::now() + kPause;
      sleep_until(next);
      continue;
    }
    if (!console.json) {
      std::ostringstream text;  // written in one piece, so that the screen does not flicker
      terminal::Console page(text, console.err());
      print_top(*now, before, options.limits, page);
      console.out() << (terminal ? kHome : shown > 0 ? "\n" : "") << text.str();
      console.out().flush();
    }
    if (options.count > 0 && shown + 1 >= options.count) break;
    before = std::move(*now);
    next += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options.interval_s));
    sleep_until(next);
  }
  return {};
}

}  // namespace

void add_top(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("top", "show robots, sessions, the worker and memory, live (Ctrl-C ends it)");
  auto options = std::make_shared<TopOptions>();
  command->add_option("--interval", options->interval_s, "seconds between two updates")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->add_option("--count", options->count, "end after so many updates (default: when interrupted)");
  command->add_option("--robots", options->limits.robots, "show at most so many robots, those in trouble first")
      ->capture_default_str();
  command
      ->add_option("--sessions", options->limits.sessions,
                   "show at most so many sessions, those with the newest frames first")
      ->capture_default_str();
  command->footer(
      "Robots in trouble are listed first, with what is wrong. A robot that falls silent without ending its session "
      "stays\n"
      "listed for ten minutes.\n"
      "Examples:\n"
      "  relmap top\n"
      "  relmap top --interval 5\n"
      "  relmap --json top --count 1 | jq -r 'select(.robots).robots[].robot'");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) { return run(*options, client, console); };
  });
}

}  // namespace relmap::cli
