#include "storage/rocksdb/folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "storage/file.h"

namespace relmap {
namespace {

constexpr const char* kProduct = "relmap map";

Status failed(const std::string& what) {
  const Reason reason = errno == EROFS ? Reason::READ_ONLY : errno == ENOSPC ? Reason::DISK_FULL : Reason::IO_ERROR;
  return Status(reason, what + ": " + std::strerror(errno));
}

}  // namespace

Result<std::unique_ptr<FolderLock>> FolderLock::take(const std::string& directory) {
  const std::string path = directory + "/LOCK";
  int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0 && (errno == EROFS || errno == EACCES)) fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return failed(path);
  std::unique_ptr<FolderLock> lock(new FolderLock(fd));
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return failed(path);
    return Status(Reason::FOLDER_LOCKED, directory + " is owned by another process");
  }
  return lock;
}

FolderLock::~FolderLock() { ::close(fd_); }

Result<int> read_format(const std::string& directory) {
  const std::string path = directory + "/FORMAT";
  std::ifstream in(path);
  if (!in) return 0;
  std::string line;
  std::getline(in, line);
  int format = 0, end = 0;
  if (std::sscanf(line.c_str(), "relmap map %9d%n", &format, &end) == 1 && end == static_cast<int>(line.size()) &&
      format > 0)
    return format;
  return Status(Reason::UNKNOWN_FORMAT_VERSION, path + " says \"" + line + "\"");
}

Status check_format(const std::string& directory, bool read_only, int format) {
  const std::string path = directory + "/FORMAT";
  const auto found = read_format(directory);
  if (!found.ok()) return found.status();
  if (*found == format) return {};
  if (*found != 0)
    return Status(Reason::UNKNOWN_FORMAT_VERSION,
                  directory + " holds a map of format " + std::to_string(*found) + ", this build reads format " +
                      std::to_string(format) +
                      (*found < format ? "; `relmap-admin migrate` brings it over" : "; it is of a newer release"));
  if (read_only) return Status(Reason::NO_SUCH_FILE, directory + " holds no map");
  const auto files = posix_file_system();
  if (files->list(directory + "/map").ok())
    return Status(Reason::UNKNOWN_FORMAT_VERSION, directory + " holds a map, but no " + path);
  return write_format(directory, format);
}

Status write_format(const std::string& directory, int format) {
  const auto files = posix_file_system();
  const std::string path = directory + "/FORMAT";
  const std::string draft = path + ".new";
  std::remove(draft.c_str());
  auto file = files->open_append(draft);
  if (!file.ok()) return file.status();
  const std::string text = std::string(kProduct) + " " + std::to_string(format) + "\n";
  if (Status status = (*file)->append(as_bytes(text)); !status.ok()) return status;
  if (Status status = (*file)->sync(); !status.ok()) return status;
  if (std::rename(draft.c_str(), path.c_str()) != 0) return failed(path);
  return files->sync_directory(directory);
}

}  // namespace relmap
