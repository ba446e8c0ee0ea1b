#include "storage/rocksdb/retryable_files.h"

namespace relmap::storage {
namespace {

using rocksdb::FileOptions;
using rocksdb::IODebugContext;
using rocksdb::IOOptions;
using rocksdb::IOStatus;
using rocksdb::Slice;

// Leaves out the subcode for a full disk, which would make RocksDB wait for room in a thread of its own.
IOStatus marked(const IOStatus& status) noexcept {
  if (!status.IsIOError()) return status;
  IOStatus again = IOStatus::IOError(status.getState() ? status.getState() : "");
  again.SetRetryable(true);
  return again;
}

class RetryableFile final : public rocksdb::FSWritableFileOwnerWrapper {
 public:
  using FSWritableFileOwnerWrapper::FSWritableFileOwnerWrapper;

  IOStatus Append(const Slice& data, const IOOptions& options, IODebugContext* dbg) override {
    return marked(target()->Append(data, options, dbg));
  }
  IOStatus Append(const Slice& data, const IOOptions& options, const rocksdb::DataVerificationInfo& info,
                  IODebugContext* dbg) override {
    return marked(target()->Append(data, options, info, dbg));
  }
  IOStatus PositionedAppend(const Slice& data, std::uint64_t offset, const IOOptions& options,
                            IODebugContext* dbg) override {
    return marked(target()->PositionedAppend(data, offset, options, dbg));
  }
  IOStatus PositionedAppend(const Slice& data, std::uint64_t offset, const IOOptions& options,
                            const rocksdb::DataVerificationInfo& info, IODebugContext* dbg) override {
    return marked(target()->PositionedAppend(data, offset, options, info, dbg));
  }
  IOStatus Truncate(std::uint64_t size, const IOOptions& options, IODebugContext* dbg) override {
    return marked(target()->Truncate(size, options, dbg));
  }
  IOStatus Close(const IOOptions& options, IODebugContext* dbg) override {
    return marked(target()->Close(options, dbg));
  }
  IOStatus Flush(const IOOptions& options, IODebugContext* dbg) override {
    return marked(target()->Flush(options, dbg));
  }
  IOStatus Sync(const IOOptions& options, IODebugContext* dbg) override { return marked(target()->Sync(options, dbg)); }
  IOStatus Fsync(const IOOptions& options, IODebugContext* dbg) override {
    return marked(target()->Fsync(options, dbg));
  }
  IOStatus RangeSync(std::uint64_t offset, std::uint64_t bytes, const IOOptions& options,
                     IODebugContext* dbg) override {
    return marked(target()->RangeSync(offset, bytes, options, dbg));
  }
};

class RetryableReads final : public rocksdb::FSRandomAccessFileOwnerWrapper {
 public:
  using FSRandomAccessFileOwnerWrapper::FSRandomAccessFileOwnerWrapper;

  IOStatus Read(std::uint64_t offset, std::size_t bytes, const IOOptions& options, Slice* result, char* scratch,
                IODebugContext* dbg) const override {
    return marked(target()->Read(offset, bytes, options, result, scratch, dbg));
  }
  IOStatus MultiRead(rocksdb::FSReadRequest* requests, std::size_t count, const IOOptions& options,
                     IODebugContext* dbg) override {
    const IOStatus status = target()->MultiRead(requests, count, options, dbg);
    for (std::size_t k = 0; k < count; ++k) requests[k].status = marked(requests[k].status);
    return marked(status);
  }
  IOStatus Prefetch(std::uint64_t offset, std::size_t bytes, const IOOptions& options, IODebugContext* dbg) override {
    return marked(target()->Prefetch(offset, bytes, options, dbg));
  }
};

class RetryableDirectory final : public rocksdb::FSDirectoryWrapper {
 public:
  using FSDirectoryWrapper::FSDirectoryWrapper;

  IOStatus Fsync(const IOOptions& options, IODebugContext* dbg) override {
    return marked(FSDirectoryWrapper::Fsync(options, dbg));
  }
  IOStatus FsyncWithDirOptions(const IOOptions& options, IODebugContext* dbg,
                               const rocksdb::DirFsyncOptions& how) override {
    return marked(FSDirectoryWrapper::FsyncWithDirOptions(options, dbg, how));
  }
};

class RetryableFiles final : public rocksdb::FileSystemWrapper {
 public:
  using FileSystemWrapper::FileSystemWrapper;
  const char* Name() const override { return "RetryableFiles"; }

  IOStatus NewWritableFile(const std::string& name, const FileOptions& options,
                           std::unique_ptr<rocksdb::FSWritableFile>* result, IODebugContext* dbg) noexcept override {
    const IOStatus status = target()->NewWritableFile(name, options, result, dbg);
    if (!status.ok()) return marked(status);
    *result = std::make_unique<RetryableFile>(std::move(*result));
    return status;
  }
  IOStatus ReopenWritableFile(const std::string& name, const FileOptions& options,
                              std::unique_ptr<rocksdb::FSWritableFile>* result, IODebugContext* dbg) noexcept override {
    const IOStatus status = target()->ReopenWritableFile(name, options, result, dbg);
    if (!status.ok()) return marked(status);
    *result = std::make_unique<RetryableFile>(std::move(*result));
    return status;
  }
  IOStatus NewRandomAccessFile(const std::string& name, const FileOptions& options,
                               std::unique_ptr<rocksdb::FSRandomAccessFile>* result,
                               IODebugContext* dbg) noexcept override {
    const IOStatus status = target()->NewRandomAccessFile(name, options, result, dbg);
    if (!status.ok()) return marked(status);
    *result = std::make_unique<RetryableReads>(std::move(*result));
    return status;
  }
  IOStatus NewDirectory(const std::string& name, const IOOptions& options,
                        std::unique_ptr<rocksdb::FSDirectory>* result, IODebugContext* dbg) noexcept override {
    const IOStatus status = target()->NewDirectory(name, options, result, dbg);
    if (!status.ok()) return marked(status);
    *result = std::make_unique<RetryableDirectory>(std::move(*result));
    return status;
  }
  IOStatus RenameFile(const std::string& from, const std::string& to, const IOOptions& options,
                      IODebugContext* dbg) override {
    return marked(target()->RenameFile(from, to, options, dbg));
  }
};

}  // namespace

std::shared_ptr<rocksdb::FileSystem> retryable_files(std::shared_ptr<rocksdb::FileSystem> files) {
  return std::make_shared<RetryableFiles>(std::move(files));
}

}  // namespace relmap::storage
