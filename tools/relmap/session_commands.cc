// relmap sessions and session: sessions are listed, frozen, thawed and deleted.
#include <algorithm>
#include <memory>
#include <ostream>

#include "proto/base/visible_text.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/view_options.h"
#include "tools/terminal/console.h"
#include "tools/terminal/interrupt.h"
#include "tools/terminal/progress_bar.h"

namespace relmap::cli {

namespace {

std::string camera_text(const StereoCamera& c) {
  return std::to_string(c.width) + "x" + std::to_string(c.height) + ", f " + fixed(c.f, 1) +
         (c.is_stereo() ? ", baseline " + fixed(c.baseline, 3) + " m" : ", mono");
}

void print(const std::vector<client::Session>& sessions, terminal::Console& console) {
  std::vector<std::vector<std::string>> rows;
  for (const client::Session& s : sessions)
    rows.push_back({std::to_string(s.number), s.name, s.robot, name_of(s.state), count_text(s.frames),
                    std::to_string(s.first) + ".." + std::to_string(s.last), count_text(s.refused),
                    count_text(s.given_up), terminal::time_text(s.first_time_us),
                    terminal::duration_text(static_cast<double>(s.last_time_us - s.first_time_us) * 1e-6),
                    camera_text(s.camera)});
  console.table(
      {">no", "session", "robot", "state", ">frames", "indices", ">refused", ">given up", "began", ">lasted", "camera"},
      rows);
}

void add_freeze(CLI::App& app, Action& action, const char* name, const char* description, bool frozen) {
  auto* command = app.add_subcommand(name, description);
  auto session = std::make_shared<std::string>();
  command->add_option("SESSION", *session, "number or name")->required();
  command->footer(
      std::string(frozen ? ""
                         : "The session returns to the state before the freeze: one that had ended is ended again.\n") +
      "Examples:\n  relmap session " + name + " survey-2026\n  relmap session " + name + " 3");
  command->callback([&action, session, frozen] {
    action = [session, frozen](client::Client& client, terminal::Console& console) -> Status {
      const auto number = find_session(client, console, *session);
      if (!number.ok()) return number.status();
      const Status done = client.freeze_session(*number, frozen);
      if (done.ok() && !console.json)
        console.out() << "session " << *number
                      << (frozen ? " is frozen\n" : " is thawed, in the state that it had before the freeze\n");
      return done;
    };
  });
}

struct DeleteOptions {
  std::string session;
  bool yes = false;
};

Status confirm_deletion(const client::Session& session, terminal::Console& console) {
  const std::string which = "session " + std::to_string(session.number) + " '" + session.name + "' of robot " +
                            session.robot + " with its " + counted_text(session.frames, "frame");
  if (!terminal::can_ask()) return {Reason::NOT_CONFIRMED, which + " would be deleted for good: --yes confirms it"};
  return terminal::ask(console, "Delete " + which + ", for good?");
}

Status delete_session(const DeleteOptions& options, client::Client& client, terminal::Console& console) {
  client::Session session;
  {
    const terminal::Console::Aside aside(console);
    const auto number = find_session(client, console, options.session);
    if (!number.ok()) return number.status();
    const auto sessions = client.sessions();
    if (!sessions.ok()) return sessions.status();
    const auto found = std::find_if(sessions->begin(), sessions->end(),
                                    [&](const client::Session& known) { return known.number == *number; });
    if (found == sessions->end()) return {Reason::NO_SUCH_SESSION, "no session " + options.session};
    session = *found;
  }
  if (!options.yes && session.state != client::SessionState::kDeleting)
    if (Status meant = confirm_deletion(session, console); !meant.ok()) return meant;
  terminal::watch_interrupts();
  terminal::ProgressBar bar(console.err(), terminal::is_terminal());
  std::uint64_t frames = session.frames;
  const auto show = [&](const client::Progress& progress) {
    const std::uint64_t left = progress.total - progress.done;
    frames = std::max(frames, left);  // a robot may have gone on sending
    if (!console.json) bar.show(progress.step, frames - left, frames, progress.unit);
    return !terminal::interrupted();
  };
  Status status;
  do status = client.delete_session(session.number, session.uuid, show);
  while (status.reason() == Reason::DEADLINE && !terminal::interrupted());
  bar.end();
  if (terminal::interrupted() && !status.ok())
    return {status.reason(), "the daemon goes on deleting session " + std::to_string(session.number) +
                                 "; the same command shows how far it is"};
  if (status.ok() && !console.json)
    console.out() << "session " << session.number << " '" << visible_text(session.name) << "' is deleted\n";
  return status;
}

void add_delete(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("delete",
                                     "take the frames of a session out of the map, for good; other sessions keep the "
                                     "landmarks that they see, and stay connected where it connected them");
  auto options = std::make_shared<DeleteOptions>();
  command->add_option("SESSION", options->session, "number or name")->required();
  command->add_flag("--yes", options->yes, "do not ask");
  command->footer(
      "The daemon goes on deleting if this command is interrupted (Ctrl-C), and after a restart. Keyframes that a "
      "robot\n"
      "still sends for the session are refused (SESSION_DELETED). The command asks first on a terminal; elsewhere it "
      "is\n"
      "refused without --yes (NOT_CONFIRMED, exit code 1).\n"
      "Examples:\n"
      "  relmap session delete test-drive\n"
      "  relmap session delete 7 --yes");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) {
      return delete_session(*options, client, console);
    };
  });
}

}  // namespace

void add_sessions(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("sessions", "list the sessions in the map");
  command->footer(
      "Examples:\n"
      "  relmap sessions\n"
      "  relmap --json sessions | jq -r '.sessions[] | [.number, .name, .frames] | @tsv'");
  command->callback([&action] {
    action = [](client::Client& client, terminal::Console& console) -> Status {
      const auto sessions = client.sessions();
      if (!sessions.ok()) return sessions.status();
      if (!console.json) print(*sessions, console);
      return {};
    };
  });
}

void add_session(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("session", "freeze, thaw or delete a session");
  command->require_subcommand(1);
  command->footer(
      "Examples:\n"
      "  relmap session freeze survey-2026   # takes no more keyframes, is not adjusted; thaw undoes it\n"
      "  relmap session delete test-drive    # for good; asks first");
  add_freeze(*command, action, "freeze", "make a session take no more keyframes, and adjust nothing in it any more",
             true);
  add_freeze(*command, action, "thaw",
             "undo a freeze: the session takes keyframes again, and is adjusted with its surroundings", false);
  add_delete(*command, action);
}

}  // namespace relmap::cli
