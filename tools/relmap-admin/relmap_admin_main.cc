#include <iostream>

#include "tools/console/interrupt.h"
#include "tools/console/progress_bar.h"
#include "tools/relmap-admin/cli.h"

int main(int argc, char** argv) {
  relmap::cli::watch_interrupts();
  return relmap::admin::run(argc, argv, std::cout, std::cerr, relmap::cli::is_terminal());
}
