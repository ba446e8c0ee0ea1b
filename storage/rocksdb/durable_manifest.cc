#include "storage/rocksdb/durable_manifest.h"

#include "storage/io/file.h"

namespace relmap::storage {
namespace {

class DurableManifest final : public rocksdb::FileSystemWrapper {
 public:
  using FileSystemWrapper::FileSystemWrapper;
  const char* Name() const override { return "DurableManifest"; }

  rocksdb::IOStatus RenameFile(const std::string& from, const std::string& to, const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* dbg) noexcept override {
    if (to.ends_with("/CURRENT")) {
      std::unique_ptr<rocksdb::FSDirectory> folder;
      auto synced = target()->NewDirectory(folder_of(to), options, &folder, dbg);
      if (synced.ok()) synced = folder->Fsync(options, dbg);
      if (!synced.ok()) return synced;
    }
    return target()->RenameFile(from, to, options, dbg);
  }
};

}  // namespace

std::shared_ptr<rocksdb::FileSystem> durable_manifest(std::shared_ptr<rocksdb::FileSystem> files) {
  return std::make_shared<DurableManifest>(std::move(files));
}

}  // namespace relmap::storage
