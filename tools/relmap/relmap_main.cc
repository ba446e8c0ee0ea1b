#include <iostream>

#include "tools/relmap/cli.h"

int main(int argc, char** argv) { return relmap::cli::run(argc, argv, std::cout, std::cerr); }
