// The figures that `relmap-bench ... --json` prints.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/patience.h"

namespace relmap::testing {

class BenchFigures {
 public:
  // Runs a subcommand of relmap-bench to its end, and prints its output. Throws if it fails.
  explicit BenchFigures(const std::vector<std::string>& arguments, std::chrono::milliseconds patience = kPatience);

  // Throw if there is no such figure. null becomes NaN, which satisfies no comparison.
  double operator[](const std::string& key) const;
  std::vector<double> series(const std::string& key) const;

 private:
  struct Parsed;
  std::shared_ptr<const Parsed> parsed_;
};

}  // namespace relmap::testing
