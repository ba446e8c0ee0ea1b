#include <iostream>

#include "tools/camera/cli.h"

int main(int argc, char** argv) { return relmap::camera::run(argc, argv, std::cout, std::cerr); }
