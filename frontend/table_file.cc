#include "frontend/table_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <ios>

namespace relmap::frontend {

Result<std::ofstream> open_table(const std::string& path, const std::string& names, bool goes_on) {
  std::error_code error;
  std::string found;
  const bool is_file = std::filesystem::is_regular_file(path, error);  // a device may give lines without end
  if (is_file) std::getline(std::ifstream(path), found);
  if (found != names && is_file && std::filesystem::file_size(path, error) > 0)
    return {Reason::INVALID_ARGUMENT, path + " has not the columns of a report: it is neither replaced nor gone on in"};
  std::ofstream out(path, goes_on ? std::ios::app : std::ios::trunc);
  if (!out) return {Reason::IO_ERROR, path + " cannot be written: " + std::strerror(errno)};
  if (!goes_on || found.empty()) out << names << '\n';
  out << std::fixed << std::flush;
  return out;
}

}  // namespace relmap::frontend
