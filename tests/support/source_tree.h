// The project's own sources, for tests that read them.
#pragma once

#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <string>
#include <vector>

#include "tests/paths.h"

namespace relmap::testing {

inline const std::filesystem::path kSourceTree = RELMAP_SOURCE_DIR;

// Every .h and .cc file below the named folders of the source tree, as paths relative to it, e.g.
// "proto/base/status.h".
inline std::vector<std::string> sources_in(std::initializer_list<const char*> folders) {
  std::vector<std::string> files;
  for (const char* folder : folders)
    for (const auto& entry : std::filesystem::recursive_directory_iterator(kSourceTree / folder))
      if (const auto ending = entry.path().extension(); entry.is_regular_file() && (ending == ".h" || ending == ".cc"))
        files.push_back(std::filesystem::relative(entry.path(), kSourceTree).string());
  return files;
}

inline std::string content_of(const std::string& file) {
  std::stringstream content;
  content << std::ifstream(kSourceTree / file).rdbuf();
  return content.str();
}

}  // namespace relmap::testing
