// The project's own sources, for tests that read them.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <string>
#include <vector>

#include "tests/paths.h"

namespace relmap::testing {

inline const std::filesystem::path kSourceTree = RELMAP_SOURCE_DIR;

// All files below the named folders of the source tree that have one of these extensions, as paths relative to the
// tree; without what npm installs there, which others wrote.
inline std::vector<std::string> files_in(std::initializer_list<const char*> folders,
                                         std::initializer_list<const char*> endings) {
  std::vector<std::string> files;
  for (const char* folder : folders)
    for (std::filesystem::recursive_directory_iterator entry(kSourceTree / folder), end; entry != end; ++entry) {
      if (entry->path().filename() == "node_modules") entry.disable_recursion_pending();
      if (entry->is_regular_file() &&
          std::find(endings.begin(), endings.end(), entry->path().extension()) != endings.end())
        files.push_back(std::filesystem::relative(entry->path(), kSourceTree).string());
    }
  return files;
}

// Every .h and .cc file below the named folders of the source tree, as paths relative to it, e.g.
// "proto/base/status.h".
inline std::vector<std::string> sources_in(std::initializer_list<const char*> folders) {
  return files_in(folders, {".h", ".cc"});
}

inline std::string content_of(const std::string& file) {
  std::stringstream content;
  content << std::ifstream(kSourceTree / file).rdbuf();
  return content.str();
}

}  // namespace relmap::testing
