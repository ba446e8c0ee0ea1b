// Reads the figures that the documents state, for tests that compare them with the code.
#pragma once

#include <algorithm>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/source_tree.h"

namespace relmap::testing {

// Returns the figures in `document` (docs/rba.md) where `pattern` first matches, one for each of its groups. A blank in
// the pattern matches a line break, too. Thousands separators are removed. Throws if nothing matches: the sentence was
// changed, and its test must be changed, too.
inline std::vector<double> published(const std::string& document, const std::string& pattern) {
  std::string text = content_of(document);
  std::replace(text.begin(), text.end(), '\n', ' ');
  std::smatch found;
  if (!std::regex_search(text, found, std::regex(pattern)))
    throw std::runtime_error(document + " does not say '" + pattern + "'");
  std::vector<double> figures;
  for (std::size_t group = 1; group < found.size(); ++group) {
    std::string figure = found[group];
    figure.erase(std::remove(figure.begin(), figure.end(), ','), figure.end());
    figures.push_back(std::stod(figure));
  }
  return figures;
}

// The same for a pattern with one group.
inline double published_figure(const std::string& document, const std::string& pattern) {
  return published(document, pattern).at(0);
}

}  // namespace relmap::testing
