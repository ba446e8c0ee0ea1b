// RocksDB's files on a real disk whose power can fail: then the sectors that were not synced, and what was done to the
// names of files whose folder was not (made, replaced, removed), are forgotten, each by chance. A folder that was
// created here is gone with all that is in it, by chance, until the folder above it is synced. Only for tests; a
// header, so that no program carries it.
#pragma once

#include <rocksdb/file_system.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "storage/io/file.h"

namespace relmap::storage {

class ForgetfulMapFiles final : public rocksdb::FileSystemWrapper {
  using IOStatus = rocksdb::IOStatus;
  using IOOptions = rocksdb::IOOptions;
  using IODebugContext = rocksdb::IODebugContext;

 public:
  // `sync == false`: syncs return at once and make nothing durable.
  ForgetfulMapFiles(std::uint64_t seed, bool sync)
      : FileSystemWrapper(rocksdb::FileSystem::Default()), sync_(sync), rng_(seed) {}
  const char* Name() const override { return "ForgetfulMapFiles"; }

  // The power fails at the n-th write or sync from now.
  void fail_power_after(std::uint64_t operations) {
    const std::lock_guard lock(mutex_);
    operations_left_ = operations;
  }
  bool has_power() const {
    const std::lock_guard lock(mutex_);
    return power_;
  }
  // Forgets what was not durable, and restores the power. The database must be closed.
  void restart() {
    const std::lock_guard lock(mutex_);
    forget_folders();
    for (const auto& [path, file] : files_) {
      if (file.name_durable || !chance()) {
        if (std::filesystem::exists(path)) forget(path, file);
        continue;
      }
      std::filesystem::remove(path);
      if (file.replaced) std::ofstream(path, std::ios::binary) << *file.replaced;
    }
    for (const Removed& removed : removed_) {
      if (chance() && !std::filesystem::exists(removed.path)) {
        std::filesystem::rename(removed.kept_as, removed.path);
        forget(removed.path, removed.file);
      }
      std::filesystem::remove(removed.kept_as);
    }
    files_.clear();
    removed_.clear();
    folders_.clear();
    power_ = true;
    operations_left_.reset();
  }

  IOStatus NewWritableFile(const std::string& name, const rocksdb::FileOptions& options,
                           std::unique_ptr<rocksdb::FSWritableFile>* result, IODebugContext* dbg) override {
    const std::lock_guard lock(mutex_);
    if (!power_) return no_power();
    IOStatus status = target()->NewWritableFile(name, options, result, dbg);
    if (!status.ok()) return status;
    files_[name] = {};
    *result = std::make_unique<File>(this, name, std::move(*result));
    return status;
  }
  IOStatus ReuseWritableFile(const std::string&, const std::string&, const rocksdb::FileOptions&,
                             std::unique_ptr<rocksdb::FSWritableFile>*, IODebugContext*) override {
    return IOStatus::NotSupported("reuse of files");
  }
  IOStatus CreateDir(const std::string& name, const IOOptions&, IODebugContext*) override {
    return std::filesystem::exists(name) ? IOStatus::IOError(name + " exists") : create_folder(name);
  }
  IOStatus CreateDirIfMissing(const std::string& name, const IOOptions&, IODebugContext*) override {
    return create_folder(name);
  }
  IOStatus NewDirectory(const std::string& name, const IOOptions& options,
                        std::unique_ptr<rocksdb::FSDirectory>* result, IODebugContext* dbg) override {
    IOStatus status = target()->NewDirectory(name, options, result, dbg);
    if (status.ok()) *result = std::make_unique<Directory>(this, name, std::move(*result));
    return status;
  }
  IOStatus RenameFile(const std::string& from, const std::string& to, const IOOptions& options,
                      IODebugContext* dbg) override {
    const std::lock_guard lock(mutex_);
    if (!power_) return no_power();
    State moved = state_of(from);
    moved.name_durable = false;
    if (std::ifstream old(to, std::ios::binary); old)
      moved.replaced = std::string(std::istreambuf_iterator<char>(old), {});
    files_.erase(from);
    files_[to] = moved;
    return target()->RenameFile(from, to, options, dbg);
  }
  IOStatus DeleteFile(const std::string& name, const IOOptions& options, IODebugContext* dbg) override {
    const std::lock_guard lock(mutex_);
    if (!power_) return no_power();
    // Kept beside the database's folder, which lists its files.
    const std::string folder = std::filesystem::path(name).parent_path().string();
    const Removed removed{name, folder + "." + std::to_string(removals_++) + ".removed", state_of(name)};
    std::error_code error;
    std::filesystem::create_hard_link(name, removed.kept_as, error);
    if (!error) removed_.push_back(removed);
    files_.erase(name);
    return target()->DeleteFile(name, options, dbg);
  }

  // Creates a folder whose name is durable after sync_names() of the folder above. Succeeds if it exists already.
  IOStatus create_folder(const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (!spend()) return no_power();
    std::error_code error;
    if (std::filesystem::create_directory(name, error)) folders_.insert(name);
    return error ? IOStatus::IOError(name + ": " + error.message()) : IOStatus::OK();
  }
  IOStatus sync_names(const std::string& directory) {
    const std::lock_guard lock(mutex_);
    if (!spend()) return no_power();
    if (!sync_) return IOStatus::OK();
    for (auto& [path, file] : files_) {
      if (folder_of(path) != directory) continue;
      file.name_durable = true;
      file.replaced.reset();
    }
    std::erase_if(removed_, [&](const Removed& removed) {
      return folder_of(removed.path) == directory && std::filesystem::remove(removed.kept_as);
    });
    std::erase_if(folders_, [&](const std::string& folder) { return folder_of(folder) == directory; });
    return IOStatus::OK();
  }

 private:
  static constexpr std::uint64_t kSector = 512;  // written whole or not at all

  struct State {
    std::uint64_t size = 0, durable = 0;
    bool name_durable = false;
    std::optional<std::string> replaced;  // the file that had this name before
  };
  struct Removed {
    std::string path, kept_as;
    State file;
  };

  class File final : public rocksdb::FSWritableFileOwnerWrapper {
   public:
    File(ForgetfulMapFiles* disk, std::string name, std::unique_ptr<rocksdb::FSWritableFile> file)
        : FSWritableFileOwnerWrapper(std::move(file)), disk_(disk), name_(std::move(name)) {}
    IOStatus Append(const rocksdb::Slice& data, const IOOptions& options, IODebugContext* dbg) override {
      if (!disk_->grow(name_, data.size())) return no_power();
      return FSWritableFileOwnerWrapper::Append(data, options, dbg);
    }
    IOStatus Append(const rocksdb::Slice& data, const IOOptions& options, const rocksdb::DataVerificationInfo&,
                    IODebugContext* dbg) override {
      return Append(data, options, dbg);
    }
    IOStatus Sync(const IOOptions&, IODebugContext*) override { return disk_->sync(name_); }
    IOStatus Fsync(const IOOptions&, IODebugContext*) override { return disk_->sync(name_); }

   private:
    ForgetfulMapFiles* const disk_;
    const std::string name_;
  };

  class Directory final : public rocksdb::FSDirectoryWrapper {
   public:
    Directory(ForgetfulMapFiles* disk, std::string name, std::unique_ptr<rocksdb::FSDirectory> directory)
        : FSDirectoryWrapper(std::move(directory)), disk_(disk), name_(std::move(name)) {}
    IOStatus Fsync(const IOOptions&, IODebugContext*) override { return disk_->sync_names(name_); }
    IOStatus FsyncWithDirOptions(const IOOptions&, IODebugContext*, const rocksdb::DirFsyncOptions&) override {
      return disk_->sync_names(name_);
    }

   private:
    ForgetfulMapFiles* const disk_;
    const std::string name_;
  };

  State state_of(const std::string& name) const {
    if (const auto known = files_.find(name); known != files_.end()) return known->second;
    std::error_code error;  // long durable
    const std::uint64_t size = std::filesystem::file_size(name, error);
    return error ? State{} : State{size, size, true, {}};
  }

  // The outermost folders come first, so what is in a folder that is gone is not asked about.
  void forget_folders() {
    for (const std::string& folder : folders_) {
      if (!std::filesystem::exists(folder) || chance()) continue;
      std::filesystem::remove_all(folder);
      const auto is_in_it = [&](const std::string& path) { return path.starts_with(folder + "/"); };
      std::erase_if(files_, [&](const auto& file) { return is_in_it(file.first); });
      std::erase_if(removed_, [&](const Removed& removed) {
        if (is_in_it(removed.path)) std::filesystem::remove(removed.kept_as);
        return is_in_it(removed.path);
      });
    }
  }

  bool chance() { return std::uniform_int_distribution<int>(0, 1)(rng_) == 1; }
  // The length and each sector behind what is durable reach the disk independently of each other.
  void forget(const std::string& path, const State& file) {
    std::uint64_t size = chance() ? file.durable : file.size;
    if (chance()) size = std::uniform_int_distribution<std::uint64_t>(file.durable, file.size)(rng_);
    std::filesystem::resize_file(path, size);
    const double likely = std::array{0.0, 0.5, 0.9, 1.0}[std::uniform_int_distribution<std::size_t>(0, 3)(rng_)];
    std::fstream bytes(path, std::ios::in | std::ios::out | std::ios::binary);
    for (std::uint64_t at = file.durable; at < size;) {
      const std::uint64_t end = std::min(size, (at / kSector + 1) * kSector);
      if (!std::bernoulli_distribution(likely)(rng_))
        bytes.seekp(static_cast<std::streamoff>(at)) << std::string(end - at, '\0');
      at = end;
    }
  }

  static IOStatus no_power() { return IOStatus::IOError("the power has failed"); }
  bool spend() {
    if (power_ && operations_left_ && --*operations_left_ == 0) power_ = false;
    return power_;
  }
  bool grow(const std::string& name, std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    if (!spend()) return false;
    files_[name].size += bytes;
    return true;
  }
  IOStatus sync(const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (!spend()) return no_power();
    if (sync_) files_[name].durable = files_[name].size;
    return IOStatus::OK();
  }

  const bool sync_;
  mutable std::mutex mutex_;
  std::mt19937_64 rng_;
  std::map<std::string, State> files_;  // written since the last restart
  std::vector<Removed> removed_;        // removed names that may come back
  std::set<std::string> folders_;       // created, and the folder above not synced since
  std::uint64_t removals_ = 0;
  std::optional<std::uint64_t> operations_left_;
  bool power_ = true;
};

// The folders of a map on that disk, for RocksDbOptions::folder_files. All else is the machine's own file system.
class ForgetfulFolders : public FileSystem {
 public:
  explicit ForgetfulFolders(std::shared_ptr<ForgetfulMapFiles> disk) : disk_(std::move(disk)) {}

  Status create_directory(const std::string& path) override { return converted(disk_->create_folder(path)); }
  Status sync_directory(const std::string& path) override { return converted(disk_->sync_names(path)); }

  Result<std::vector<std::string>> list(const std::string& directory) const override { return real_->list(directory); }
  Result<std::unique_ptr<AppendFile>> open_append(const std::string& path) override { return real_->open_append(path); }
  Result<std::unique_ptr<ReadFile>> open_read(const std::string& path) const override { return real_->open_read(path); }
  Status truncate(const std::string& path, std::uint64_t size) override { return real_->truncate(path, size); }
  Status remove(const std::string& path) override { return real_->remove(path); }
  Result<DiskRoom> room(const std::string& directory) const override { return real_->room(directory); }
  Status occupy(const std::string& path, std::uint64_t bytes) override { return real_->occupy(path, bytes); }

 private:
  static Status converted(const rocksdb::IOStatus& status) {
    return status.ok() ? Status() : Status(Reason::IO_ERROR, status.ToString());
  }

  const std::shared_ptr<ForgetfulMapFiles> disk_;
  const std::shared_ptr<FileSystem> real_ = posix_file_system();
};

}  // namespace relmap::storage
