#include "storage/rocksdb/torn_manifest.h"

#include <algorithm>
#include <cstring>
#include <string>

#include "proto/base/bytes.h"
#include "storage/rocksdb/manifest_log.h"

namespace relmap::storage {
namespace {

class FirstBytes final : public rocksdb::FSSequentialFile {
 public:
  explicit FirstBytes(std::string bytes) : bytes_(std::move(bytes)) {}
  rocksdb::IOStatus Read(std::size_t n, const rocksdb::IOOptions& /*options*/, rocksdb::Slice* result, char* scratch,
                         rocksdb::IODebugContext* /*dbg*/) override {
    const std::size_t count = std::min(n, bytes_.size() - at_);
    std::memcpy(scratch, bytes_.data() + at_, count);
    at_ += count;
    *result = rocksdb::Slice(scratch, count);
    return rocksdb::IOStatus::OK();
  }
  rocksdb::IOStatus Skip(std::uint64_t n) override {
    at_ += std::min<std::uint64_t>(n, bytes_.size() - at_);
    return rocksdb::IOStatus::OK();
  }

 private:
  const std::string bytes_;
  std::size_t at_ = 0;
};

class TornManifest final : public rocksdb::FileSystemWrapper {
 public:
  TornManifest(std::shared_ptr<rocksdb::FileSystem> files, std::shared_ptr<const std::atomic<bool>> forgive)
      : FileSystemWrapper(std::move(files)), forgive_(std::move(forgive)) {}
  const char* Name() const override { return "TornManifest"; }

  rocksdb::IOStatus NewSequentialFile(const std::string& path, const rocksdb::FileOptions& options,
                                      std::unique_ptr<rocksdb::FSSequentialFile>* file,
                                      rocksdb::IODebugContext* dbg) noexcept override {
    if (!*forgive_ || path.substr(path.rfind('/') + 1).rfind("MANIFEST-", 0) != 0)
      return target()->NewSequentialFile(path, options, file, dbg);
    std::string all;
    if (auto read = rocksdb::ReadFileToString(target(), path, &all); !read.ok())
      return rocksdb::status_to_io_status(std::move(read));
    all.resize(length_without_torn_end(as_bytes(all)));
    *file = std::make_unique<FirstBytes>(std::move(all));
    return rocksdb::IOStatus::OK();
  }

 private:
  const std::shared_ptr<const std::atomic<bool>> forgive_;
};

}  // namespace

std::shared_ptr<rocksdb::FileSystem> torn_manifest(std::shared_ptr<rocksdb::FileSystem> files,
                                                   std::shared_ptr<const std::atomic<bool>> forgive) {
  return std::make_shared<TornManifest>(std::move(files), std::move(forgive));
}

}  // namespace relmap::storage
