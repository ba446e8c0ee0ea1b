// Reads the figures that the documents state, for tests that compare them with the code.
#pragma once

#include <string>
#include <vector>

namespace relmap::testing {

// Returns the figures in `document` (docs/rba.md) where `pattern` first matches, one for each of its groups. A blank in
// the pattern matches a line break, too. Thousands separators are removed. Throws if nothing matches: the sentence was
// changed, and its test must be changed, too.
std::vector<double> published(const std::string& document, const std::string& pattern);

// The same for a pattern with one group.
double published_figure(const std::string& document, const std::string& pattern);

// Fail the test if a short run's value is more than 1.5 times the published one; expect_about() also if it is less than
// the published one divided by 1.5.
constexpr double kFactor = 1.5;
void expect_at_most(double value, double published, const std::string& what);
void expect_about(double value, double published, const std::string& what);

}  // namespace relmap::testing
