#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "storage/io/file.h"

namespace relmap::storage {
namespace {

Reason reason_of(int error) {
  switch (error) {
    case ENOENT:
      return Reason::NO_SUCH_FILE;
    case ENOSPC:
    case EDQUOT:
      return Reason::DISK_FULL;
    case EROFS:
      return Reason::READ_ONLY;
    case EMFILE:
    case ENFILE:
      return Reason::TOO_MANY_FILES;
    default:
      return Reason::IO_ERROR;
  }
}

Status failed(const std::string& what, const std::string& path, int error = errno) {
  return Status(reason_of(error), what + " " + path + ": " + std::strerror(error));
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  bool ok() const { return fd_ >= 0; }

 private:
  int fd_;
};

class PosixAppendFile final : public AppendFile {
 public:
  PosixAppendFile(int fd, std::string path, bool sync) : fd_(fd), path_(std::move(path)), sync_(sync) {}

  Status append(ByteSpan bytes) override {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_.get(), bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return failed("write to", path_);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return {};
  }

  Status sync() override {
    if (sync_ && ::fdatasync(fd_.get()) != 0) return failed("sync of", path_);
    return {};
  }

 private:
  const Descriptor fd_;
  const std::string path_;
  const bool sync_;
};

class PosixReadFile final : public ReadFile {
 public:
  PosixReadFile(int fd, std::string path, std::uint64_t size) : fd_(fd), path_(std::move(path)), size_(size) {}

  std::uint64_t size() const override { return size_; }

  Result<Bytes> read(std::uint64_t offset, std::size_t size) const override {
    Bytes bytes(size);
    for (std::size_t done = 0; done < size;) {
      const ssize_t got = ::pread(fd_.get(), bytes.data() + done, size - done, static_cast<off_t>(offset + done));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return failed("read of", path_);
      if (got == 0) return Status(Reason::IO_ERROR, path_ + " ends before byte " + std::to_string(offset + size));
      done += static_cast<std::size_t>(got);
    }
    return bytes;
  }

 private:
  const Descriptor fd_;
  const std::string path_;
  const std::uint64_t size_;
};

class PosixFileSystem final : public FileSystem {
 public:
  explicit PosixFileSystem(bool sync) : sync_(sync) {}

  Status create_directory(const std::string& path) override {
    if (::mkdir(path.c_str(), S_IRWXU) != 0 && errno != EEXIST) return failed("creation of folder", path);
    return {};
  }

  Result<std::vector<std::string>> list(const std::string& directory) const override {
    DIR* dir = ::opendir(directory.c_str());
    if (!dir) return failed("listing of", directory);
    std::vector<std::string> names;
    while (const dirent* entry = ::readdir(dir)) {
      const std::string name = entry->d_name;
      if (name != "." && name != "..") names.push_back(name);
    }
    ::closedir(dir);
    std::sort(names.begin(), names.end());
    return names;
  }

  Result<std::unique_ptr<AppendFile>> open_append(const std::string& path) override {
    const int fd = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
    if (fd < 0) return failed("opening of", path);
    return std::unique_ptr<AppendFile>(std::make_unique<PosixAppendFile>(fd, path, sync_));
  }

  Result<std::unique_ptr<ReadFile>> open_read(const std::string& path) const override {
    const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) return failed("opening of", path);
    struct stat info {};
    if (::fstat(fd, &info) != 0) {
      const Status status = failed("size of", path);
      ::close(fd);
      return status;
    }
    return std::unique_ptr<ReadFile>(
        std::make_unique<PosixReadFile>(fd, path, static_cast<std::uint64_t>(info.st_size)));
  }

  Status truncate(const std::string& path, std::uint64_t size) override {
    const Descriptor fd(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    if (!fd.ok()) return failed("opening of", path);
    if (::ftruncate(fd.get(), static_cast<off_t>(size)) != 0) return failed("truncation of", path);
    if (sync_ && ::fsync(fd.get()) != 0) return failed("sync of", path);
    return {};
  }

  Status remove(const std::string& path) override {
    if (::unlink(path.c_str()) != 0) return failed("removal of", path);
    return {};
  }

  Status sync_directory(const std::string& path) override {
    if (!sync_) return {};
    const Descriptor fd(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!fd.ok()) return failed("opening of folder", path);
    if (::fsync(fd.get()) != 0) return failed("sync of folder", path);
    return {};
  }

  Result<DiskRoom> room(const std::string& directory) const override {
    struct statvfs info {};
    if (::statvfs(directory.c_str(), &info) != 0) return failed("free space of", directory);
    return DiskRoom{std::uint64_t{info.f_bavail} * info.f_frsize, std::uint64_t{info.f_blocks} * info.f_frsize};
  }

  Status occupy(const std::string& path, std::uint64_t bytes) override {
    const Descriptor fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR));
    if (!fd.ok()) return failed("opening of", path);
    const int error = ::posix_fallocate(fd.get(), 0, static_cast<off_t>(bytes));
    if (error == 0) return {};
    ::unlink(path.c_str());
    return failed("reservation of " + std::to_string(bytes) + " bytes in", path, error);
  }

 private:
  const bool sync_;
};

}  // namespace

std::shared_ptr<FileSystem> posix_file_system(bool sync) { return std::make_shared<PosixFileSystem>(sync); }

}  // namespace relmap::storage
