// relmap watch: what happens to the map, line by line.
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <ostream>
#include <utility>

#include "proto/base/clock.h"
#include "proto/base/visible_text.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/output_files.h"
#include "tools/relmap/view_options.h"
#include "tools/relmap/watch_view.h"
#include "tools/terminal/interrupt.h"

namespace relmap::cli {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kGather{1};  // frames, for a line; and tokens, for the file of --state

struct WatchCommand {
  std::string from = "now", resume, state;
  std::vector<std::string> sessions;
  bool no_frames = false;
  double for_s = 0;  // 0: until interrupted
};

// The token that an earlier run left; empty if there was none. IO_ERROR.
Result<std::string> read_state(const std::string& file) {
  std::error_code error;
  if (file.empty() || !std::filesystem::exists(file, error)) return std::string();
  std::ifstream in(file);
  std::string token;
  if (!in || !std::getline(in, token))
    return Status(Reason::IO_ERROR, file + " cannot be read, or holds no token; without it the watch begins anew");
  return token;
}

class Watcher {
 public:
  Watcher(const WatchCommand& command, terminal::Console& console)
      : command_(command), console_(console), end_(Clock::now()) {
    if (command.for_s > 0)
      end_ += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(command.for_s));
  }

  WatchView& view() { return view_; }

  // Several times a second. Whether the watch is to end.
  bool stopped() {
    flush_if_due();
    return !failed_.ok() || terminal::interrupted() || (command_.for_s > 0 && Clock::now() >= end_);
  }

  Status take(const client::WatchEvent& event) {
    if (const auto* gone = std::get_if<client::WatchDisconnected>(&event.what)) {
      console_.err() << local_time_text(now_us())
                     << "  no connection, trying again: " << visible_text(gone->why.to_string()) << '\n';
      lost_ = true;
    } else if (std::holds_alternative<client::WatchConnected>(event.what)) {
      if (std::exchange(lost_, false)) console_.err() << local_time_text(now_us()) << "  connected again\n";
    } else if (!event.resume_token.empty()) {
      token_ = event.resume_token;
    }
    if (!console_.json) print(view_.lines_of(event));
    console_.out().flush();
    if (!gathered_since_) gathered_since_ = Clock::now();
    flush_if_due();
    return failed_;
  }

  // Prints what was gathered, and keeps the token of what is printed.
  void flush() {
    gathered_since_.reset();
    if (!console_.json) print(view_.flush());
    if (!console_.out().flush()) failed_ = {Reason::IO_ERROR, "what happens cannot be written (is the disk full?)"};
    if (failed_.ok()) failed_ = keep_token();
  }
  const Status& failed() const { return failed_; }

 private:
  void flush_if_due() {
    if (gathered_since_ && Clock::now() - *gathered_since_ >= kGather) flush();
  }
  void print(const std::vector<std::string>& lines) {
    for (const std::string& line : lines) console_.out() << line << '\n';
  }

  Status keep_token() {
    if (command_.state.empty() || token_.empty() || token_ == kept_) return {};
    OutputFiles file(command_.state, console_.out());
    const auto out = file.begin("");
    if (!out.ok()) return out.status();
    **out << token_ << '\n';
    if (Status written = file.finish(); !written.ok()) return written;
    kept_ = token_;
    return {};
  }

  const WatchCommand& command_;
  terminal::Console& console_;
  WatchView view_;
  Clock::time_point end_;
  std::optional<Clock::time_point> gathered_since_;
  std::string token_, kept_;
  bool lost_ = false;
  Status failed_;
};

Status run(const WatchCommand& command, client::Client& client, terminal::Console& console) {
  client::WatchOptions options;
  options.from = command.from == "oldest" ? client::WatchOptions::From::kOldest : client::WatchOptions::From::kNow;
  options.no_frames = command.no_frames;
  options.resume_token = command.resume;
  if (command.resume.empty()) {
    auto token = read_state(command.state);
    if (!token.ok()) return token.status();
    options.resume_token = std::move(*token);
  }
  terminal::watch_interrupts();
  Watcher watcher(command, console);
  {
    const terminal::Console::Aside aside(console);
    for (const std::string& name : command.sessions) {
      const auto session = find_session(client, console, name);
      if (!session.ok()) return session.status();
      options.sessions.push_back(*session);
    }
    if (!console.json) {
      const auto sessions = client.sessions();
      if (!sessions.ok()) return sessions.status();
      watcher.view().know(*sessions);
    }
  }
  options.stopped = [&] { return watcher.stopped(); };
  const Status watched = client.watch(options, [&](const client::WatchEvent& event) { return watcher.take(event); });
  watcher.flush();
  return watched.ok() ? watcher.failed() : watched;
}

}  // namespace

void add_watch(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("watch", "show what happens to the map, as it happens (Ctrl-C ends it)");
  auto options = std::make_shared<WatchCommand>();
  command->add_option("--from", options->from, "begin with what happens now, or with the oldest event of the log")
      ->check(CLI::IsMember({"now", "oldest"}))
      ->capture_default_str();
  command->add_option("--resume", options->resume, "go on after the event that had this token, whatever --from says")
      ->type_name("TOKEN");
  command
      ->add_option("--state", options->state,
                   "file that keeps the token: go on after what it says, and keep it up to date")
      ->type_name("FILE");
  command->add_option("--session", options->sessions, "only of this session, by number or name; may be repeated")
      ->type_name("SESSION");
  command->add_flag("--no-frames", options->no_frames, "without frames added, adjusted and skipped, which are most");
  command->add_option("--for", options->for_s, "end after so many seconds (default: when interrupted)")
      ->check(CLI::Range(0.001, 1e9))
      ->type_name("SECONDS");
  command->footer(
      "A line says when (local time), what, why and who. Frames are gathered: a line a second for each session.\n"
      "If the daemon goes, the command waits for it, says so on stderr, and goes on after the last event; whoever was\n"
      "away for longer than the daemon keeps events (an hour, or events.max_mb) is told with VIEW_EXPIRED, and should\n"
      "list again. With --state an event may be told twice after a kill, but none is left out.\n"
      "Robots and the disk are not in this log: robot lines (a robot appears, falls silent, or is blocked) and "
      "storage\n"
      "lines tell only what happens while the command runs; --from oldest, --resume and --state bring back none of "
      "them.\n"
      "relmap top shows how robots fare now.\n"
      "With --json each line is a MapEvent (docs/protocol.md) with its resumeToken.\n"
      "Examples:\n"
      "  relmap watch\n"
      "  relmap watch --from oldest --no-frames          # of the last hour: closures, labels, sessions\n"
      "  relmap watch --session morning --for 60\n"
      "  relmap --json watch --state watch.token | jq -c 'select(.edgeChanged).edgeChanged | [.id, .state]'");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) { return run(*options, client, console); };
  });
}

}  // namespace relmap::cli
