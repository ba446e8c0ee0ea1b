#include "tools/relmap/chosen_sessions.h"

#include <set>

#include "proto/base/number_text.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

std::vector<SessionNumber> ChosenSessions::numbers() const {
  std::vector<SessionNumber> numbers;
  for (const auto& [number, session] : sessions) numbers.push_back(number);
  return numbers;
}

Result<ChosenSessions> read_chosen_sessions(const std::vector<std::string>& choice, client::Client& client,
                                            terminal::Console& console) {
  std::set<SessionNumber> wanted;
  for (const std::string& text : choice) {
    const auto session = find_session(client, console, text);
    if (!session.ok()) return session.status();
    wanted.insert(*session);
  }
  auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  ChosenSessions chosen;
  chosen.all = wanted.empty();
  for (client::Session& session : *sessions) {
    if (!chosen.all && wanted.erase(session.number) == 0) continue;
    if (session.camera.is_stereo()) {
      chosen.sessions.emplace(session.number, std::move(session));
    } else if (chosen.all) {
      if (session.frames > 0) ++chosen.mono_sessions;
    } else {
      return {Reason::NOT_STEREO,
              "session " + std::to_string(session.number) + " is a mono session: nothing connects its frames"};
    }
  }
  if (!wanted.empty()) return {Reason::NO_SUCH_SESSION, "no session " + std::to_string(*wanted.begin())};
  return chosen;
}

std::string not_placed_text(std::size_t mono_sessions, const std::string& done) {
  const bool one = mono_sessions == 1;
  return counted_text(mono_sessions, "mono session") + " (photographs) " +
         (one ? "has no scale of its own and is" : "have no scale of their own and are") + " not " + done;
}

Status nothing_to_place(std::size_t mono_sessions, const std::string& verb, const std::string& done) {
  std::string text = "there is nothing to " + verb;
  if (mono_sessions > 0) text += ": " + not_placed_text(mono_sessions, done);
  return {Reason::EMPTY_MAP, text};
}

}  // namespace relmap::cli
