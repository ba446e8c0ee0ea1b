// Ctrl-C as a question that long work asks now and then.
#pragma once

namespace relmap::terminal {

// From now on the first SIGINT or SIGTERM only sets a flag, so that work can end in order; the second one ends the
// program as ever.
void watch_interrupts();
bool interrupted();

}  // namespace relmap::terminal
