#include "tools/terminal/confirmation.h"

#include <unistd.h>

#include <iostream>

namespace relmap::terminal {

bool can_ask() { return isatty(STDIN_FILENO) != 0 && isatty(STDERR_FILENO) != 0; }

Status ask(Console& console, const std::string& question) {
  console.err() << question << " [y/N] " << std::flush;
  std::string answer;
  std::getline(std::cin, answer);
  if (answer == "y" || answer == "Y" || answer == "yes" || answer == "Yes") return {};
  if (!std::cin) console.err() << '\n';  // after an end of input the cursor is still behind the question
  return {Reason::NOT_CONFIRMED, "nothing is changed"};
}

}  // namespace relmap::terminal
