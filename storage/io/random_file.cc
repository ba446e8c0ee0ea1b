#include "storage/io/random_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace relmap::storage {
namespace {

Status error(const std::string& what) {
  return {errno == ENOSPC || errno == EDQUOT ? Reason::DISK_FULL : Reason::IO_ERROR,
          what + ": " + std::strerror(errno)};
}

}  // namespace

Result<std::unique_ptr<RandomFile>> RandomFile::open(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (fd < 0) return error("opening of " + path);
  return std::unique_ptr<RandomFile>(new RandomFile(fd, path));
}

Result<std::unique_ptr<RandomFile>> RandomFile::open_temporary() {
  std::error_code failed;
  std::string path = (std::filesystem::temp_directory_path(failed) / "relmap-XXXXXX").string();
  const int fd = failed ? -1 : ::mkostemp(path.data(), O_CLOEXEC);
  if (fd < 0) return error("a temporary file " + path);
  ::unlink(path.c_str());
  return std::unique_ptr<RandomFile>(new RandomFile(fd, path));
}

RandomFile::~RandomFile() { ::close(fd_); }

Result<std::uint64_t> RandomFile::size() const {
  struct stat info {};
  if (::fstat(fd_, &info) != 0) return failed("size of");
  return static_cast<std::uint64_t>(info.st_size);
}

Status RandomFile::read(std::uint64_t offset, void* bytes, std::size_t count) const {
  auto* out = static_cast<std::uint8_t*>(bytes);
  while (count > 0) {
    const ssize_t got = ::pread(fd_, out, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failed("read of");
    if (got == 0) return {Reason::TRUNCATED, path_ + " ends at byte " + std::to_string(offset)};
    out += got;
    offset += static_cast<std::uint64_t>(got);
    count -= static_cast<std::size_t>(got);
  }
  return {};
}

Status RandomFile::write(std::uint64_t offset, ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return failed("write to");
    offset += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Status RandomFile::truncate(std::uint64_t size) {
  return ::ftruncate(fd_, static_cast<off_t>(size)) == 0 ? Status() : failed("truncation of");
}

Status RandomFile::sync() { return ::fdatasync(fd_) == 0 ? Status() : failed("sync of"); }

Status RandomFile::failed(const char* what) const { return error(std::string(what) + ' ' + path_); }

}  // namespace relmap::storage
