#include "proto/access/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

namespace relmap::access {

namespace {

Status failed(const std::string& what, const std::string& path) {
  return {Reason::IO_ERROR, "cannot " + what + " " + path + ": " + std::strerror(errno)};
}

// The owner and group of the file, or else of its folder.
bool owner_of(const std::string& path, struct stat& facts) {
  if (stat(path.c_str(), &facts) == 0) return true;
  const std::string folder = std::filesystem::absolute(path).parent_path();
  return stat(folder.c_str(), &facts) == 0;
}

bool write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t size = write(file, text.data(), text.size());
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(size));
  }
  return true;
}

}  // namespace

Result<std::string> read_file(const std::string& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return Status(Reason::NO_SUCH_FILE, "cannot read " + path + ": " + std::strerror(errno));
  std::string text;
  std::array<char, 16384> buffer{};
  ssize_t size = 0;
  while ((size = read(file, buffer.data(), buffer.size())) > 0 || (size < 0 && errno == EINTR))
    if (size > 0) text.append(buffer.data(), static_cast<std::size_t>(size));
  const Status outcome = size < 0 ? failed("read", path) : Status();
  close(file);
  if (!outcome.ok()) return outcome;
  return text;
}

Result<std::string> read_private_file(const std::string& path) {
  auto text = read_file(path);
  struct stat facts {};
  if (text.ok() && stat(path.c_str(), &facts) == 0 && (facts.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return Status(Reason::BAD_CONFIG, "others can read " + path + ": chmod 600 " + path);
  return text;
}

Status write_private_file(const std::string& path, std::string_view text) {
  const std::string temporary = path + ".new";
  struct stat owner {};
  if (!owner_of(path, owner)) return failed("write", path);
  unlink(temporary.c_str());
  const int file = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file < 0) return failed("write", temporary);
  const bool owned = (owner.st_uid == geteuid() && owner.st_gid == getegid()) ||
                     fchown(file, owner.st_uid, owner.st_gid) == 0 || owner.st_uid == geteuid();
  const bool written = owned && write_all(file, text) && fsync(file) == 0;
  Status outcome = written ? Status() : failed("write", temporary);
  if (close(file) != 0 && outcome.ok()) outcome = failed("write", temporary);
  if (outcome.ok() && std::rename(temporary.c_str(), path.c_str()) != 0) outcome = failed("write", path);
  if (!outcome.ok()) unlink(temporary.c_str());
  return outcome;
}

Result<FolderTurn> FolderTurn::take(const std::string& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return failed("open", folder);
  FolderTurn turn(descriptor);
  while (flock(descriptor, LOCK_EX) != 0)
    if (errno != EINTR) return failed("lock", folder);
  return turn;
}

FolderTurn::FolderTurn(FolderTurn&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderTurn::~FolderTurn() {
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace relmap::access
