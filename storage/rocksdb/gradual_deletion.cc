#include "storage/rocksdb/gradual_deletion.h"

#include <chrono>
#include <thread>

namespace relmap::storage {
namespace {

constexpr std::uint64_t kStep = std::uint64_t{1} << 20;

class GradualDeletion final : public rocksdb::FileSystemWrapper {
 public:
  using FileSystemWrapper::FileSystemWrapper;
  const char* Name() const override { return "GradualDeletion"; }

  // RocksDB deletes only files that its manifest, which is synced, no longer names. So a crash on the way loses
  // nothing.
  rocksdb::IOStatus DeleteFile(const std::string& name, const rocksdb::IOOptions& options,
                               rocksdb::IODebugContext* dbg) override {
    std::uint64_t links = 0, size = 0;
    const bool ours = target()->NumFileLinks(name, options, &links, dbg).ok() && links == 1;  // no backup has it
    if (ours && target()->GetFileSize(name, options, &size, dbg).ok())
      while (size > kStep && step(name, size -= kStep, options, dbg)) {
      }
    return target()->DeleteFile(name, options, dbg);
  }

 private:
  // One cut, and a pause for as long as it took.
  bool step(const std::string& name, std::uint64_t size, const rocksdb::IOOptions& options,
            rocksdb::IODebugContext* dbg) {
    const auto start = std::chrono::steady_clock::now();
    const bool cut = target()->Truncate(name, size, options, dbg).ok();
    std::this_thread::sleep_for(std::chrono::steady_clock::now() - start);
    return cut;
  }
};

}  // namespace

std::shared_ptr<rocksdb::FileSystem> gradual_deletion(std::shared_ptr<rocksdb::FileSystem> files) {
  return std::make_shared<GradualDeletion>(std::move(files));
}

}  // namespace relmap::storage
