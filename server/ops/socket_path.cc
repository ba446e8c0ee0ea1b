#include "server/ops/socket_path.h"

#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "proto/access/token.h"

namespace relmap::ops {

namespace {

constexpr std::size_t kMaxPath = sizeof(sockaddr_un::sun_path) - sizeof ".new";  // while it is made, it has that ending

Result<std::string> runtime_folder() {
  for (const char* name : {"RUNTIME_DIRECTORY", "XDG_RUNTIME_DIR"})
    if (const char* folders = std::getenv(name); folders && *folders == '/')
      return std::string(folders, std::strcspn(folders, ":"));  // systemd may give several
  const std::string folder = "/tmp/relmap-" + std::to_string(getuid());
  if (mkdir(folder.c_str(), S_IRWXU) != 0 && errno != EEXIST)
    return Status(Reason::IO_ERROR, "cannot make " + folder + ": " + std::strerror(errno));
  struct stat facts {};
  if (lstat(folder.c_str(), &facts) != 0 || !S_ISDIR(facts.st_mode) || facts.st_uid != getuid() ||
      (facts.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return Status(Reason::IO_ERROR, folder + " is no folder of this user alone; set XDG_RUNTIME_DIR to one that is");
  return folder;
}

}  // namespace

Result<std::string> socket_path(const std::string& data_folder) {
  std::string folder_path = std::filesystem::absolute(data_folder).lexically_normal();
  if (folder_path.ends_with('/')) folder_path.pop_back();
  const std::string path = folder_path + "/socket";
  const bool read_only = ::access(folder_path.c_str(), W_OK) != 0 && errno == EROFS;
  if (path.size() <= kMaxPath && !read_only) return path;
  const auto folder = runtime_folder();
  if (!folder.ok()) return folder;
  constexpr std::size_t kDigits = 32;
  return *folder + "/" + access::sha256(path).substr(0, kDigits) + ".socket";
}

}  // namespace relmap::ops
