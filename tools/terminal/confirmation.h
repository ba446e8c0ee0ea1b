// Asks the user at the terminal for confirmation.
#pragma once

#include <string>

#include "proto/base/status.h"
#include "tools/terminal/console.h"

namespace relmap::terminal {

// Whether standard input and standard error are a terminal, so that a question can be seen and answered.
bool can_ask();

// Asks "QUESTION [y/N]" on standard error and reads a line of standard input. NOT_CONFIRMED: the answer is not yes.
// `question` ends in a question mark; can_ask() must hold.
Status ask(Console& console, const std::string& question);

}  // namespace relmap::terminal
