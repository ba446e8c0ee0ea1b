// Reads text files of data sets, as a whole and line by line.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "proto/base/status.h"

namespace relmap::capture {

inline constexpr std::size_t kMaxTextBytes = std::size_t{1} << 30;

// NO_SUCH_FILE, IO_ERROR; BAD_SIZE if it is longer than kMaxTextBytes. The message names the file.
Result<std::string> read_text_file(const std::filesystem::path& path);

// The text without white space at its ends.
std::string_view trimmed(std::string_view text);

// Iterates over the trimmed lines that are neither empty nor comments (#). The text must outlive it.
class TextLines {
 public:
  explicit TextLines(std::string_view text) : rest_(text) {}

  // Moves to the next line; false at the end.
  bool next();
  std::string_view line() const { return line_; }
  // "line 12", counted from 1.
  std::string where() const { return "line " + std::to_string(number_); }

 private:
  std::string_view rest_, line_;
  std::size_t number_ = 0;
};

}  // namespace relmap::capture
