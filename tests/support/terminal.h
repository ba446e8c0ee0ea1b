// Runs programs as if a user sat at a terminal.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/patience.h"
#include "tests/support/process.h"

namespace relmap::testing {

// Runs a program to its end with a terminal as standard input and standard error; standard output is no terminal. When
// the program asks, calls `meanwhile` and then types `typed`. `standard_error` has what the terminal showed, with its
// line ends and echo. Throws if the program takes longer than `patience`.
Finished run_on_terminal(const std::vector<std::string>& arguments, const std::string& typed,
                         const std::function<void()>& meanwhile = {}, std::chrono::milliseconds patience = kPatience);

}  // namespace relmap::testing
