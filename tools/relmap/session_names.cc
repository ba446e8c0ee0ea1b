#include "tools/relmap/session_names.h"

namespace relmap::cli {

Result<SessionsByNumber> read_sessions(client::Client& client, terminal::Console& console) {
  const terminal::Console::Aside aside(console);
  auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  SessionsByNumber by_number;
  for (client::Session& session : *sessions) by_number.emplace(session.number, std::move(session));
  return by_number;
}

std::string session_words(const SessionsByNumber& sessions, SessionNumber number) {
  const std::string text = "session " + std::to_string(number);
  const auto found = sessions.find(number);
  if (found == sessions.end()) return text;
  return text + ", " + found->second.name + ", of robot " + found->second.robot;
}

}  // namespace relmap::cli
