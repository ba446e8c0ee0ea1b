#include "frontend/capture/text_file.h"

#include <algorithm>
#include <fstream>

namespace relmap::capture {

Result<std::string> read_text_file(const std::filesystem::path& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) return {Reason::NO_SUCH_FILE, path.string() + " cannot be opened"};
  if (size > kMaxTextBytes)
    return {Reason::BAD_SIZE,
            path.string() + " has " + std::to_string(size) + " bytes; at most " + std::to_string(kMaxTextBytes)};
  std::string text(size, '\0');
  in.read(text.data(), static_cast<std::streamsize>(size));
  if (in.bad()) return {Reason::IO_ERROR, path.string() + " cannot be read"};
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

std::string_view trimmed(std::string_view text) {
  constexpr const char* kBlank = " \t\r";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) + 1 - begin);
}

bool TextLines::next() {
  while (!rest_.empty()) {
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line_ = trimmed(rest_.substr(0, end));
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++number_;
    if (!line_.empty() && !line_.starts_with('#')) return true;
  }
  return false;
}

}  // namespace relmap::capture
