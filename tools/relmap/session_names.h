// The sessions of the map by number, read once for texts that name them.
#pragma once

#include <map>
#include <string>

#include "client/relmap_client.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

using SessionsByNumber = std::map<SessionNumber, client::Session>;

// Reads all sessions; with --json, the reply is not printed.
Result<SessionsByNumber> read_sessions(client::Client& client, terminal::Console& console);

// "session 3, morning, of robot cart"; "session 3" if the map does not have it.
std::string session_words(const SessionsByNumber& sessions, SessionNumber number);

}  // namespace relmap::cli
