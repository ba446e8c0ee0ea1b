#include "storage/io/open_folder.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace relmap::storage {

namespace {

namespace fs = std::filesystem;

Status failed(const std::string& what) {
  return {errno == ENOENT ? Reason::NO_SUCH_FILE : Reason::IO_ERROR, what + ": " + std::strerror(errno)};
}

}  // namespace

Result<std::unique_ptr<OpenFolder>> OpenFolder::open_at(int folder, const std::string& name, int flags) {
  const int fd = ::openat(folder, name.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | flags);
  if (fd >= 0) return std::unique_ptr<OpenFolder>(new OpenFolder(fd));
  if ((errno == ENOTDIR || errno == ELOOP) && (flags & O_NOFOLLOW) != 0)
    return Status(Reason::NOT_ALLOWED, name + " is a link, or no folder");
  return failed(name);
}

Result<std::unique_ptr<OpenFolder>> OpenFolder::open(const std::string& path) { return open_at(AT_FDCWD, path, 0); }

OpenFolder::~OpenFolder() { ::close(fd_); }

Result<std::unique_ptr<OpenFolder>> OpenFolder::child(const std::string& name) const {
  return open_at(fd_, name, O_NOFOLLOW);
}

Result<std::unique_ptr<OpenFolder>> OpenFolder::make(const std::string& name) const {
  if (::mkdirat(fd_, name.c_str(), S_IRWXU) != 0 && errno != EEXIST) return failed("making " + name);
  return child(name);
}

std::string OpenFolder::name() const {
  std::error_code unknown;
  const fs::path target = fs::read_symlink(path(), unknown);
  return unknown ? path() : target.string();
}

bool OpenFolder::empty() const { return fs::is_empty(path() + "/."); }

void OpenFolder::facts(struct stat& facts) const {
  if (::fstat(fd_, &facts) != 0) throw StatusError(failed("reading the facts of " + name()));
}

bool OpenFolder::ours() const {
  struct stat own {};
  facts(own);
  return own.st_uid == ::geteuid();
}

bool OpenFolder::private_to_us() const {
  struct stat own {};
  facts(own);
  return (own.st_uid == ::geteuid() || own.st_uid == 0) && (own.st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

bool OpenFolder::is_safe_way(const std::string& path) {
  const auto is_safe = [](const fs::path& folder) {
    struct stat facts {};
    return ::stat(folder.c_str(), &facts) == 0 && (facts.st_uid == ::geteuid() || facts.st_uid == 0) &&
           ((facts.st_mode & (S_IWGRP | S_IWOTH)) == 0 || (facts.st_mode & S_ISVTX) != 0);
  };
  for (fs::path name = fs::absolute(path).parent_path();; name = name.parent_path()) {
    for (fs::path folder = fs::canonical(name);; folder = folder.parent_path()) {
      if (!is_safe(folder)) return false;
      if (folder == folder.parent_path()) break;
    }
    if (name == name.parent_path()) return true;
  }
}

bool OpenFolder::has(const std::string& name, const OpenFolder& other) const {
  struct stat found {
  }, wanted{};
  if (::fstatat(fd_, name.c_str(), &found, AT_SYMLINK_NOFOLLOW) != 0) return false;
  other.facts(wanted);
  return found.st_dev == wanted.st_dev && found.st_ino == wanted.st_ino;
}

bool OpenFolder::exists(const std::string& name) const {
  struct stat found {};
  return ::fstatat(fd_, name.c_str(), &found, AT_SYMLINK_NOFOLLOW) == 0;
}

Status OpenFolder::restrict_to_owner() const {
  return ::fchmod(fd_, S_IRWXU) == 0 ? Status() : failed("setting the mode of " + name());
}

Status OpenFolder::rename(const std::string& from, const std::string& to) const {
  if (::renameat2(fd_, from.c_str(), fd_, to.c_str(), RENAME_NOREPLACE) == 0) return {};
  if (errno == EINVAL || errno == ENOSYS)
    if (::renameat(fd_, from.c_str(), fd_, to.c_str()) == 0) return {};
  return failed("giving " + from + " its name");
}

Status OpenFolder::sync() const { return ::fsync(fd_) == 0 ? Status() : failed("syncing " + name()); }

bool OpenFolder::remove_empty(const std::string& name) const {
  return ::unlinkat(fd_, name.c_str(), AT_REMOVEDIR) == 0;
}

void OpenFolder::clear(const std::string& but) const {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(path() + "/.", ignored))
    if (entry.path().filename() != but) fs::remove_all(entry.path(), ignored);
}

}  // namespace relmap::storage
