// The figures that the documents state, for tests that hold the code to them, and the documents to the code.
#pragma once

#include <algorithm>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/process.h"
#include "tests/support/source_tree.h"

namespace relmap::testing {

// Those that stand in `document` (docs/rba.md) where `pattern` matches: a number for each of its groups. Its blanks
// stand for line breaks, too; separators of thousands are left out. Throws where nothing matches: then the sentence was
// changed, and so is its test to be.
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

// Of one group.
inline double published_figure(const std::string& document, const std::string& pattern) {
  return published(document, pattern).at(0);
}

}  // namespace relmap::testing
