#include "tests/support/published.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <regex>
#include <stdexcept>

#include "tests/support/source_tree.h"

namespace relmap::testing {

std::vector<double> published(const std::string& document, const std::string& pattern) {
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

double published_figure(const std::string& document, const std::string& pattern) {
  return published(document, pattern).at(0);
}

void expect_at_most(double value, double published, const std::string& what) {
  std::printf("%s: %g, published %g\n", what.c_str(), value, published);
  EXPECT_LE(value, kFactor * published) << what;
}

void expect_about(double value, double published, const std::string& what) {
  expect_at_most(value, published, what);
  EXPECT_GE(value, published / kFactor) << what;
}

}  // namespace relmap::testing
