// Files that documents and comments name exist, so that a file that moves takes its mentions along.
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "tests/support/source_tree.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

bool is_there(std::string name) {
  while (name.ends_with('.') || name.ends_with('/')) name.pop_back();
  const auto exists = [](const std::string& file) { return fs::exists(kSourceTree / file); };
  return exists(name) || exists(name + ".h") || exists(name + ".cc");
}

std::vector<std::string> documents() {
  std::vector<std::string> files =
      files_in({"docs", "proto", "storage", "server", "client", "frontend", "tools", "tests", "cmake"}, {".md"});
  for (const auto& entry : fs::directory_iterator(kSourceTree))
    if (entry.path().extension() == ".md") files.push_back(entry.path().filename().string());
  return files;
}

// Matches of the expression's first group in the text, with what is to be said where one is not there.
int expect_all_there(const std::string& file, const std::string& text, const std::regex& expression) {
  int found = 0;
  for (std::sregex_iterator match(text.begin(), text.end(), expression), end; match != end; ++match, ++found)
    EXPECT_TRUE(is_there((*match)[1])) << file << " names " << (*match)[1];
  return found;
}

TEST(NamedFiles, InDocumentsExist) {
  static const std::regex kName("`((?:proto|storage|server|client|frontend|tools|tests|docs|cmake)/[\\w./-]+)`");
  int found = 0;
  for (const std::string& file : documents()) found += expect_all_there(file, content_of(file), kName);
  EXPECT_GT(found, 300);
}

TEST(NamedFiles, InCommentsExist) {
  static const std::regex kName(
      "//.*?[ (]((?:proto|storage|server|client|frontend|tools|tests|docs)/[\\w/]+\\.(?:h|cc|md))");
  int found = 0;
  for (const std::string& file : sources_in({"proto", "storage", "server", "client", "frontend", "tools", "tests"}))
    found += expect_all_there(file, content_of(file), kName);
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace relmap::testing
