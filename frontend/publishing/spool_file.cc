#include "frontend/publishing/spool_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <vector>

namespace relmap::publishing::spool_file {

namespace fs = std::filesystem;

namespace {

class File {
 public:
  explicit File(int descriptor) : descriptor_(descriptor) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  int get() const { return descriptor_; }
  bool ok() const { return descriptor_ >= 0; }

 private:
  const int descriptor_;
};

Status read_exactly(int file, std::uint64_t offset, Bytes& bytes, const std::string& path) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::pread(file, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset + done));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return io_error("read", path);
    if (n == 0) return {Reason::TRUNCATED, path + " is shorter than expected"};
    done += static_cast<std::size_t>(n);
  }
  return {};
}

}  // namespace

Status io_error(const std::string& what, const std::string& path) {
  return {Reason::IO_ERROR, what + " " + path + ": " + std::strerror(errno)};
}

Status write_all(int file, ByteSpan bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(file, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return io_error("write to", path);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

Result<Bytes> read_all(const std::string& path) {
  const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat info {};
  if (!file.ok() || ::fstat(file.get(), &info) != 0) return io_error("open", path);
  Bytes bytes(static_cast<std::size_t>(info.st_size));
  if (Status s = read_exactly(file.get(), 0, bytes, path); !s.ok()) return s;
  return bytes;
}

Result<Bytes> read_at(const std::string& path, std::uint64_t offset, std::size_t size) {
  const File file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.ok()) return io_error("open", path);
  Bytes bytes(size);
  if (Status s = read_exactly(file.get(), offset, bytes, path); !s.ok()) return s;
  return bytes;
}

Status sync_folder(const std::string& folder) {
  const File file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!file.ok() || ::fsync(file.get()) != 0) return io_error("sync", folder);
  return {};
}

Status create_folder(const std::string& folder) {
  std::error_code error;
  std::vector<fs::path> missing;
  for (fs::path path = fs::absolute(folder); !fs::exists(path, error); path = path.parent_path())
    missing.push_back(path);
  for (auto path = missing.rbegin(); path != missing.rend(); ++path)
    if (::mkdir(path->c_str(), S_IRWXU) != 0 && errno != EEXIST) return io_error("create", *path);
  for (const fs::path& path : missing)
    if (Status synced = sync_folder(path.parent_path()); !synced.ok()) return synced;
  return {};
}

Status replace(const std::string& folder, const std::string& name, ByteSpan bytes) {
  const std::string path = folder + "/" + name;
  const std::string fresh = path + ".new";
  {
    const File file(::open(fresh.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, kOwnerOnly));
    if (!file.ok()) return io_error("create", fresh);
    if (Status s = write_all(file.get(), bytes, fresh); !s.ok()) return s;
    if (::fsync(file.get()) != 0) return io_error("sync", fresh);
  }
  if (std::rename(fresh.c_str(), path.c_str()) != 0) return io_error("rename", fresh);
  return sync_folder(folder);
}

}  // namespace relmap::publishing::spool_file
