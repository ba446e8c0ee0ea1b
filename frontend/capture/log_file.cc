#include "frontend/capture/log_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace relmap::capture {

namespace {

Status failed(const std::string& what, const std::string& path) {
  return {errno == ENOSPC || errno == EDQUOT ? Reason::DISK_FULL : Reason::IO_ERROR,
          what + ' ' + path + ": " + std::strerror(errno)};
}

}  // namespace

Result<LogFile> LogFile::create(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor < 0) return failed("create", path);
  LogFile file(path, descriptor);
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0)
    return {Reason::INVALID_ARGUMENT, path + " is being written by another process"};
  const auto size = file.size();
  if (!size.ok()) return size.status();
  if (*size > 0) return {Reason::INVALID_ARGUMENT, path + " is there: it is not written over"};
  return file;
}

Result<LogFile> LogFile::open(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return {Reason::NO_SUCH_FILE, path + " cannot be opened: " + std::strerror(errno)};
  return LogFile(path, descriptor);
}

LogFile::~LogFile() {
  if (file_ >= 0) ::close(file_);
}

Result<std::uint64_t> LogFile::size() const {
  struct stat info {};
  if (::fstat(file_, &info) != 0) return failed("look at", path_);
  return static_cast<std::uint64_t>(info.st_size);
}

Status LogFile::append(ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(file_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failed("write to", path_);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

Status LogFile::sync() {
  if (::fdatasync(file_) != 0 && errno != EINVAL) return failed("sync", path_);  // EINVAL: a pipe, which has no disk
  return {};
}

void LogFile::cut(std::uint64_t bytes) {
  if (::ftruncate(file_, static_cast<off_t>(bytes)) != 0) return;
}

Status LogFile::read(std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t n = ::pread(file_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return failed("read", path_);
    if (n == 0) return {Reason::TRUNCATED, path_ + " ends at byte " + std::to_string(offset)};
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
  return {};
}

Status sync_folder_of(const std::string& path) {
  const std::string folder = std::filesystem::absolute(path).parent_path().string();
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return failed("open", folder);
  const Status status = ::fsync(descriptor) != 0 ? failed("sync", folder) : Status();
  ::close(descriptor);
  return status;
}

}  // namespace relmap::capture
