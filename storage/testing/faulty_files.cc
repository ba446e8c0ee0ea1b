#include "storage/testing/faulty_files.h"

namespace relmap::storage {
namespace {

Status told(const std::atomic<Reason>& reason, const std::string& path) {
  const Reason now = reason;
  return now == Reason::OK ? Status() : Status(now, path + " failed, as it was told to");
}

class FaultyAppendFile final : public AppendFile {
 public:
  FaultyAppendFile(std::unique_ptr<AppendFile> file, std::string path, std::shared_ptr<DiskFaults> faults)
      : file_(std::move(file)), path_(std::move(path)), faults_(std::move(faults)) {}

  Status append(ByteSpan bytes) override {
    const Status fault = told(faults_->write, path_);
    if (fault.ok()) return file_->append(bytes);
    if (fault.reason() == Reason::DISK_FULL) (void)file_->append(bytes.first(bytes.size() / 2));
    return fault;
  }
  Status sync() override {
    const Status fault = told(faults_->sync, path_);
    return fault.ok() ? file_->sync() : fault;
  }

 private:
  const std::unique_ptr<AppendFile> file_;
  const std::string path_;
  const std::shared_ptr<DiskFaults> faults_;
};

class FaultyReadFile final : public ReadFile {
 public:
  FaultyReadFile(std::unique_ptr<ReadFile> file, std::string path, std::shared_ptr<DiskFaults> faults)
      : file_(std::move(file)), path_(std::move(path)), faults_(std::move(faults)) {}

  std::uint64_t size() const override { return file_->size(); }
  Result<Bytes> read(std::uint64_t offset, std::size_t size) const override {
    if (Status fault = told(faults_->read, path_); !fault.ok()) return fault;
    return file_->read(offset, size);
  }

 private:
  const std::unique_ptr<ReadFile> file_;
  const std::string path_;
  const std::shared_ptr<DiskFaults> faults_;
};

class FaultyFiles final : public FileSystem {
 public:
  FaultyFiles(std::shared_ptr<FileSystem> files, std::shared_ptr<DiskFaults> faults, std::string only)
      : files_(std::move(files)), faults_(std::move(faults)), only_(std::move(only)) {}

  Status create_directory(const std::string& path) override { return files_->create_directory(path); }
  Result<std::vector<std::string>> list(const std::string& directory) const override { return files_->list(directory); }
  Result<std::unique_ptr<AppendFile>> open_append(const std::string& path) override {
    if (Status fault = strikes(faults_->write, path); fault.reason() == Reason::READ_ONLY) return fault;
    auto file = files_->open_append(path);
    if (!file.ok() || path.find(only_) == std::string::npos) return file;
    return std::unique_ptr<AppendFile>(std::make_unique<FaultyAppendFile>(std::move(*file), path, faults_));
  }
  Result<std::unique_ptr<ReadFile>> open_read(const std::string& path) const override {
    auto file = files_->open_read(path);
    if (!file.ok() || path.find(only_) == std::string::npos) return file;
    return std::unique_ptr<ReadFile>(std::make_unique<FaultyReadFile>(std::move(*file), path, faults_));
  }
  Status truncate(const std::string& path, std::uint64_t size) override {
    if (Status fault = strikes(faults_->write, path); fault.reason() == Reason::READ_ONLY) return fault;
    if (Status fault = strikes(faults_->sync, path); !fault.ok()) return fault;
    return files_->truncate(path, size);
  }
  Status remove(const std::string& path) override {
    if (Status fault = strikes(faults_->write, path); fault.reason() == Reason::READ_ONLY) return fault;
    if (faults_->removal_helps && faults_->write == Reason::DISK_FULL) {
      faults_->write = Reason::OK;
      faults_->free = std::uint64_t{8} << 20;
    }
    return files_->remove(path);
  }
  Status sync_directory(const std::string& path) override {
    const Status fault = strikes(faults_->sync, path);
    return fault.ok() ? files_->sync_directory(path) : fault;
  }
  Result<DiskRoom> room(const std::string&) const override { return DiskRoom{faults_->free, faults_->size}; }
  Status occupy(const std::string& path, std::uint64_t bytes) override {
    const Status fault = strikes(faults_->write, path);
    return fault.ok() ? files_->occupy(path, bytes) : fault;
  }

 private:
  Status strikes(const std::atomic<Reason>& reason, const std::string& path) const {
    return path.find(only_) == std::string::npos ? Status() : told(reason, path);
  }

  const std::shared_ptr<FileSystem> files_;
  const std::shared_ptr<DiskFaults> faults_;
  const std::string only_;
};

}  // namespace

std::shared_ptr<FileSystem> faulty_files(std::shared_ptr<FileSystem> files, std::shared_ptr<DiskFaults> faults,
                                         const std::string& only) {
  return std::make_shared<FaultyFiles>(std::move(files), std::move(faults), only);
}

}  // namespace relmap::storage
