#include <sys/stat.h>

#include <cstdlib>
#include <iostream>

#include "tools/relmap-admin/cli.h"
#include "tools/terminal/interrupt.h"
#include "tools/terminal/progress_bar.h"

int main(int argc, char** argv) {
  umask(S_IRWXG | S_IRWXO);             // maps, backups and credentials are nobody else's
  setenv("GRPC_VERBOSITY", "NONE", 0);  // what it says of handshakes that fail, the program says in its own words
  relmap::terminal::watch_interrupts();
  return relmap::admin::run(argc, argv, std::cout, std::cerr, relmap::terminal::is_terminal());
}
