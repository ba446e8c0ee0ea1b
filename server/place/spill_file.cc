#include "server/place/spill_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace relmap {
namespace {

Status failed(const std::string& what) { return {Reason::IO_ERROR, what + " failed: " + std::strerror(errno)}; }

}  // namespace

Result<std::unique_ptr<SpillFile>> SpillFile::create(const std::string& folder) {
  std::string path = folder + "/spill-XXXXXX";
  const int fd = ::mkostemp(path.data(), O_CLOEXEC);
  if (fd < 0) return failed("making a temporary file in " + folder);
  std::unique_ptr<SpillFile> file(new SpillFile(fd));
  if (::unlink(path.c_str()) != 0) return failed("unlinking " + path);
  return file;
}

SpillFile::~SpillFile() { ::close(fd_); }

Status SpillFile::append(ByteSpan bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(size_));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return failed("writing to a temporary file");
    size_ += static_cast<std::uint64_t>(written);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return {};
}

Status SpillFile::read(std::uint64_t offset, void* bytes, std::size_t count) const {
  auto* out = static_cast<std::uint8_t*>(bytes);
  while (count > 0) {
    const ssize_t got = ::pread(fd_, out, count, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failed("reading a temporary file");
    if (got == 0) return {Reason::IO_ERROR, "a temporary file ends early"};
    out += got;
    offset += static_cast<std::uint64_t>(got);
    count -= static_cast<std::size_t>(got);
  }
  return {};
}

}  // namespace relmap
