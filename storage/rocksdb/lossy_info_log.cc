#include "storage/rocksdb/lossy_info_log.h"

#include <rocksdb/env.h>

#include <string>

namespace relmap::storage {
namespace {

// Nothing that is done to it fails.
class LossyFile final : public rocksdb::FSWritableFileOwnerWrapper {
 public:
  using FSWritableFileOwnerWrapper::FSWritableFileOwnerWrapper;

  rocksdb::IOStatus Append(const rocksdb::Slice& data, const rocksdb::IOOptions& options,
                           rocksdb::IODebugContext* dbg) override {
    return passed(target()->Append(data, options, dbg));
  }
  rocksdb::IOStatus Append(const rocksdb::Slice& data, const rocksdb::IOOptions& options,
                           const rocksdb::DataVerificationInfo& info, rocksdb::IODebugContext* dbg) override {
    return passed(target()->Append(data, options, info, dbg));
  }
  rocksdb::IOStatus Flush(const rocksdb::IOOptions& options, rocksdb::IODebugContext* dbg) override {
    return passed(target()->Flush(options, dbg));
  }
  rocksdb::IOStatus Sync(const rocksdb::IOOptions& options, rocksdb::IODebugContext* dbg) override {
    return passed(target()->Sync(options, dbg));
  }
  rocksdb::IOStatus RangeSync(std::uint64_t offset, std::uint64_t bytes, const rocksdb::IOOptions& options,
                              rocksdb::IODebugContext* dbg) override {
    return passed(target()->RangeSync(offset, bytes, options, dbg));
  }
  rocksdb::IOStatus Truncate(std::uint64_t size, const rocksdb::IOOptions& options,
                             rocksdb::IODebugContext* dbg) override {
    return passed(target()->Truncate(size, options, dbg));
  }
  rocksdb::IOStatus Close(const rocksdb::IOOptions& options, rocksdb::IODebugContext* dbg) override {
    return passed(target()->Close(options, dbg));
  }

 private:
  static rocksdb::IOStatus passed(const rocksdb::IOStatus& status) {
    status.PermitUncheckedError();
    return rocksdb::IOStatus::OK();
  }
};

class LossyInfoLog final : public rocksdb::FileSystemWrapper {
 public:
  using FileSystemWrapper::FileSystemWrapper;
  const char* Name() const override { return "LossyInfoLog"; }

  // The wrapper's would write to a file that the wrapped file system opens by itself.
  rocksdb::IOStatus NewLogger(const std::string& path, const rocksdb::IOOptions& options,
                              std::shared_ptr<rocksdb::Logger>* result,
                              rocksdb::IODebugContext* dbg) noexcept override {
    return FileSystem::NewLogger(path, options, result, dbg);
  }
  rocksdb::IOStatus NewWritableFile(const std::string& path, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSWritableFile>* result,
                                    rocksdb::IODebugContext* dbg) noexcept override {
    const auto status = target()->NewWritableFile(path, options, result, dbg);
    if (status.ok() && path.ends_with("/LOG")) *result = std::make_unique<LossyFile>(std::move(*result));
    return status;
  }
};

}  // namespace

std::shared_ptr<rocksdb::FileSystem> lossy_info_log(std::shared_ptr<rocksdb::FileSystem> files) {
  return std::make_shared<LossyInfoLog>(std::move(files));
}

}  // namespace relmap::storage
