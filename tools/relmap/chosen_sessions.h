// The sessions of a map that a picture or an export shows.
#pragma once

#include <string>
#include <vector>

#include "tools/relmap/session_names.h"

namespace relmap::cli {

struct ChosenSessions {
  SessionsByNumber sessions;
  std::size_t mono_sessions = 0;  // left out: nothing connects their frames, which have no scale
  bool all = true;                // the user chose none

  std::vector<SessionNumber> numbers() const;
};

// The sessions that the user chose (numbers or names; none: all except mono sessions). NO_SUCH_SESSION; NOT_STEREO if a
// mono session was chosen.
Result<ChosenSessions> read_chosen_sessions(const std::vector<std::string>& choice, client::Client& client,
                                            terminal::Console& console);

// "3 mono sessions (photographs) have no scale of their own and are not drawn"; `done` is "drawn".
std::string not_placed_text(std::size_t mono_sessions, const std::string& done);
// The refusal of sessions without frames (EMPTY_MAP): "there is nothing to draw", and how many mono sessions there are.
// `verb` is "draw", `done` is "drawn".
Status nothing_to_place(std::size_t mono_sessions, const std::string& verb, const std::string& done);

}  // namespace relmap::cli
