#include "tools/vocab/picture_folder.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace relmap::vocab {
namespace fs = std::filesystem;
namespace {

bool looks_like_picture(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".png" || extension == ".webp" || extension == ".jpg" || extension == ".jpeg";
}

}  // namespace

Result<std::vector<std::string>> list_pictures(const std::vector<std::string>& paths, std::size_t every) {
  std::vector<std::string> result;
  for (const std::string& path : paths) {
    std::error_code error;
    if (fs::is_regular_file(path, error)) {
      result.push_back(path);
      continue;
    }
    std::vector<std::string> found;
    for (fs::recursive_directory_iterator it(path, error), end; !error && it != end; it.increment(error))
      if (it->is_regular_file() && looks_like_picture(it->path())) found.push_back(it->path().string());
    if (error) return Status(Reason::NO_SUCH_FILE, path + ": " + error.message());
    std::sort(found.begin(), found.end());
    for (std::size_t i = 0; i < found.size(); i += every) result.push_back(found[i]);
  }
  return result;
}

Status write_file(const std::string& path, const Bytes& bytes) {
  const std::string unfinished = path + ".tmp";
  {
    std::ofstream out(unfinished, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    out.flush();
    if (!out) return Status(Reason::IO_ERROR, unfinished + ": " + std::generic_category().message(errno));
  }
  std::error_code error;
  fs::rename(unfinished, path, error);
  if (error) return Status(Reason::IO_ERROR, path + ": " + error.message());
  return {};
}

}  // namespace relmap::vocab
