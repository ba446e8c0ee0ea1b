// Parts of documents that follow from the code: compared with it, or with RELMAP_WRITE_DOCS=1 in the environment
// written anew.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "tests/support/source_tree.h"

namespace relmap::testing {

inline bool writes_documents() {
  const char* const write = std::getenv("RELMAP_WRITE_DOCS");
  return write && *write == '1';
}

// The whole file.
inline void expect_generated(const std::string& file, const std::string& text) {
  if (writes_documents()) std::ofstream(kSourceTree / file) << text;
  EXPECT_EQ(content_of(file), text) << file << " is out of date: RELMAP_WRITE_DOCS=1 writes it anew";
}

// What stands between the lines "<!-- NAME: begin -->" and "<!-- NAME: end -->".
inline void expect_generated_part(const std::string& file, const std::string& name, const std::string& text) {
  std::string all = content_of(file);
  const std::string begin = "<!-- " + name + ": begin -->\n", end = "<!-- " + name + ": end -->";
  const std::size_t at = all.find(begin), to = all.find(end);
  ASSERT_TRUE(at != std::string::npos && to != std::string::npos && at + begin.size() <= to) << file << ": " << name;
  const std::size_t from = at + begin.size();
  if (writes_documents()) {
    all.replace(from, to - from, text);
    std::ofstream(kSourceTree / file) << all;
    return;
  }
  EXPECT_EQ(all.substr(from, to - from), text) << file << " is out of date: RELMAP_WRITE_DOCS=1 writes it anew";
}

}  // namespace relmap::testing
