// Sessions: looked at and changed.
#include <memory>

#include "tools/relmap/commands.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

std::string camera_text(const StereoCamera& c) {
  return std::to_string(c.width) + "x" + std::to_string(c.height) + ", f " + fixed(c.f, 1) +
         (c.is_stereo() ? ", baseline " + fixed(c.baseline, 3) + " m" : ", mono");
}

void print(const std::vector<client::Session>& sessions, Console& console) {
  std::vector<std::vector<std::string>> rows;
  for (const client::Session& s : sessions)
    rows.push_back({std::to_string(s.number), s.name, s.robot, name_of(s.state), std::to_string(s.frames),
                    std::to_string(s.first) + ".." + std::to_string(s.last), std::to_string(s.refused),
                    std::to_string(s.given_up), time_text(s.first_time_us),
                    duration_text(static_cast<double>(s.last_time_us - s.first_time_us) * 1e-6),
                    camera_text(s.camera)});
  console.table(
      {">no", "session", "robot", "state", ">frames", "indices", ">refused", ">given up", "began", ">lasted", "camera"},
      rows);
}

void add_freeze(CLI::App& app, Action& action, const char* name, const char* description, bool frozen) {
  auto* command = app.add_subcommand(name, description);
  auto session = std::make_shared<std::string>();
  command->add_option("SESSION", *session, "number or name")->required();
  command->callback([&action, session, frozen] {
    action = [session, frozen](client::Client& client, Console& console) -> Status {
      const auto number = find_session(client, console, *session);
      if (!number.ok()) return number.status();
      return client.freeze_session(*number, frozen);
    };
  });
}

}  // namespace

void add_sessions(CLI::App& app, Action& action) {
  app.add_subcommand("sessions", "the trajectories in the map")->callback([&action] {
    action = [](client::Client& client, Console& console) -> Status {
      const auto sessions = client.sessions();
      if (!sessions.ok()) return sessions.status();
      if (!console.json) print(*sessions, console);
      return {};
    };
  });
}

void add_session(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("session", "change a session");
  command->require_subcommand(1);
  add_freeze(*command, action, "freeze", "it takes no more keyframes, and nothing in it moves", true);
  add_freeze(*command, action, "thaw", "it takes keyframes again, and is relaxed with what is around it", false);
}

}  // namespace relmap::cli
