#include "tools/relmap/output_files.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <ostream>
#include <regex>
#include <utility>

namespace relmap::cli {

namespace fs = std::filesystem;

namespace {

std::string beside(const std::string& name) { return name + ".partial"; }

Status not_written(const std::string& name) {
  return {Reason::IO_ERROR, name + " cannot be written: " + std::strerror(errno)};
}

// What part_suffix() makes.
bool is_part_suffix(const std::string& text) {
  static const std::regex kPattern("[0-9]+-[0-9]+");
  return std::regex_match(text, kPattern);
}

}  // namespace

std::string part_suffix(FrameId root) { return std::to_string(root.session) + "-" + std::to_string(root.index); }

OutputFiles::OutputFiles(std::string path, std::ostream& standard_output)
    : path_(path == "-" ? std::string() : std::move(path)), standard_output_(standard_output) {
  std::error_code ignored;
  if (!path_.empty()) in_place_ = fs::exists(path_, ignored) && !fs::is_regular_file(path_, ignored);
}

OutputFiles::~OutputFiles() {
  file_.close();
  std::error_code ignored;
  for (const std::string& name : names_) fs::remove(beside(name), ignored);
}

std::string OutputFiles::name(const std::string& suffix) const {
  if (path_.empty()) return "-";
  if (suffix.empty()) return path_;
  const fs::path path(path_);
  fs::path named = path;
  named.replace_filename(path.stem().string() + "." + suffix + path.extension().string());
  return named.string();
}

Result<std::ostream*> OutputFiles::begin(const std::string& suffix) {
  if (path_.empty()) return &standard_output_;
  if (Status status = end(); !status.ok()) return status;
  const std::string named = name(suffix);
  errno = 0;
  file_.open(in_place_ ? named : beside(named), std::ios::binary | std::ios::trunc);
  if (!file_) return not_written(named);
  if (!in_place_) names_.push_back(named);
  return static_cast<std::ostream*>(&file_);
}

Status OutputFiles::end() {
  if (path_.empty()) {
    standard_output_.flush();
    return standard_output_ ? Status() : Status(Reason::IO_ERROR, "the export cannot be written");
  }
  if (!file_.is_open()) return {};
  errno = 0;
  file_.close();
  if (!file_) return not_written(names_.empty() ? path_ : names_.back());
  return {};
}

Status OutputFiles::finish() {
  if (Status status = end(); !status.ok()) return status;
  for (; !names_.empty(); names_.pop_back()) {
    std::error_code error;
    fs::rename(beside(names_.back()), names_.back(), error);
    if (error) return {Reason::IO_ERROR, names_.back() + " cannot be written: " + error.message()};
    written_.push_back(names_.back());
  }
  return {};
}

std::vector<std::string> OutputFiles::left_behind() const {
  std::vector<std::string> left;
  if (in_place_) return left;
  const fs::path path(path_);
  const std::string begin = path.stem().string() + ".", end = path.extension().string();
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(path.has_parent_path() ? path.parent_path() : ".", ignored)) {
    const std::string file = entry.path().filename().string();
    if (file.size() <= begin.size() + end.size() || !file.starts_with(begin) || !file.ends_with(end)) continue;
    const std::string suffix = file.substr(begin.size(), file.size() - begin.size() - end.size());
    if (!is_part_suffix(suffix)) continue;
    if (std::find(written_.begin(), written_.end(), name(suffix)) == written_.end()) left.push_back(name(suffix));
  }
  std::sort(left.begin(), left.end());
  return left;
}

Spool::Spool(const std::string& beside) {
  static std::atomic<unsigned> count{0};
  const std::string name = ".relmap-spool-" + std::to_string(::getpid()) + "-" + std::to_string(++count);
  path_ = (beside.empty() ? fs::temp_directory_path() : fs::path(beside).parent_path()) / name;
}

Spool::~Spool() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove(path_, ignored);
}

Spool::Spool(Spool&& other) noexcept : path_(std::exchange(other.path_, {})) {}

Status Spool::append(std::string_view bytes) {
  errno = 0;
  std::ofstream file(path_, std::ios::binary | std::ios::app);
  file << bytes;
  file.close();
  return file ? Status() : not_written(path_);
}

Status Spool::copy_to(std::ostream& out) const {
  std::ifstream file(path_, std::ios::binary);
  if (file.is_open() && file.peek() != std::ifstream::traits_type::eof()) out << file.rdbuf();
  return out ? Status() : Status(Reason::IO_ERROR, "the export cannot be written");
}

}  // namespace relmap::cli
