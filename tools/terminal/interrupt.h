// Ctrl-C as a flag that long work checks from time to time.
#pragma once

namespace relmap::terminal {

// After this call the first SIGINT or SIGTERM only sets a flag, so that work can end in order. A second one ends the
// program as usual.
void watch_interrupts();
bool interrupted();

}  // namespace relmap::terminal
