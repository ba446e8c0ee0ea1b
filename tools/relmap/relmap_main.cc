#include <cstdlib>
#include <iostream>

#include "tools/relmap/cli.h"

int main(int argc, char** argv) {
  setenv("GRPC_VERBOSITY", "NONE", 0);  // what it says of handshakes that fail, the program says in its own words
  return relmap::cli::run(argc, argv, std::cout, std::cerr);
}
