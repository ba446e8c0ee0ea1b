// What verification says about a map on disk.
#pragma once

#include <string>
#include <vector>

#include "storage/maintenance/verify.h"

namespace relmap::testing {

// A line for each thing that is wrong with the last commit or with the journal behind it. Throws StatusError if they
// cannot be read.
inline std::vector<std::string> verify_findings(const storage::Engine& engine) {
  std::vector<std::string> wrong;
  const auto found = [&](const storage::Finding& finding) {
    wrong.push_back("verify: " + finding.frame.to_string() + " " + finding.what);
  };
  (void)storage::verify(*engine.snapshot(), {}, found, {}).or_throw();
  (void)storage::verify_journal(engine, found, {}).or_throw();
  return wrong;
}

}  // namespace relmap::testing
