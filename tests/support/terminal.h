// Programs run by somebody who sits at a terminal.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace relmap::testing {

// Runs a program to its end with a terminal as standard input and standard error, at which `typed` is typed once the
// program has asked for it. What it wrote there is `standard_error`, with the terminal's line ends and echo; standard
// output is no terminal. `meanwhile` is called between question and answer. Throws if it takes longer than `patience`.
Finished run_on_terminal(const std::vector<std::string>& arguments, const std::string& typed,
                         const std::function<void()>& meanwhile = {},
                         std::chrono::milliseconds patience = std::chrono::seconds(50));

}  // namespace relmap::testing
