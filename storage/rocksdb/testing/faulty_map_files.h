// RocksDB's files on a disk that fails on demand (storage/testing/faulty_files.h), for as long as it is told to. Only
// for tests; a header, so that no program carries it.
#pragma once

#include <rocksdb/file_system.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <memory>
#include <string>
#include <thread>

#include "storage/testing/faulty_files.h"

namespace relmap::storage {

class FaultyMapFiles final : public rocksdb::FileSystemWrapper {
  using IOStatus = rocksdb::IOStatus;
  using IOOptions = rocksdb::IOOptions;
  using IODebugContext = rocksdb::IODebugContext;
  using Slice = rocksdb::Slice;

 public:
  // Faults strike files whose paths contain `only` (".sst", ".blob", ".log", "MANIFEST" ...).
  FaultyMapFiles(std::shared_ptr<DiskFaults> faults, std::string only = "")
      : FileSystemWrapper(rocksdb::FileSystem::Default()), faults_(std::move(faults)), only_(std::move(only)) {}
  const char* Name() const override { return "FaultyMapFiles"; }

  IOStatus NewWritableFile(const std::string& name, const rocksdb::FileOptions& options,
                           std::unique_ptr<rocksdb::FSWritableFile>* result, IODebugContext* dbg) override {
    const IOStatus fault = told(faults_->write, name);
    if (faults_->write == Reason::READ_ONLY && !fault.ok()) return fault;
    IOStatus status = target()->NewWritableFile(name, options, result, dbg);
    if (status.ok()) *result = std::make_unique<Writable>(this, name, std::move(*result));
    return status;
  }
  IOStatus NewRandomAccessFile(const std::string& name, const rocksdb::FileOptions& options,
                               std::unique_ptr<rocksdb::FSRandomAccessFile>* result, IODebugContext* dbg) override {
    IOStatus status = target()->NewRandomAccessFile(name, options, result, dbg);
    if (status.ok()) *result = std::make_unique<Readable>(this, name, std::move(*result));
    return status;
  }
  IOStatus NewDirectory(const std::string& name, const IOOptions& options,
                        std::unique_ptr<rocksdb::FSDirectory>* result, IODebugContext* dbg) override {
    IOStatus status = target()->NewDirectory(name, options, result, dbg);
    if (status.ok()) *result = std::make_unique<Directory>(this, name, std::move(*result));
    return status;
  }

 private:
  class Writable final : public rocksdb::FSWritableFileOwnerWrapper {
   public:
    Writable(FaultyMapFiles* disk, std::string name, std::unique_ptr<rocksdb::FSWritableFile> file)
        : FSWritableFileOwnerWrapper(std::move(file)), disk_(disk), name_(std::move(name)) {}
    IOStatus Append(const Slice& data, const IOOptions& options, IODebugContext* dbg) override {
      while (disk_->faults_->hang && disk_->strikes(name_)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      const IOStatus fault = disk_->told(disk_->faults_->write, name_);
      if (fault.ok()) return target()->Append(data, options, dbg);
      (void)target()->Append(Slice(data.data(), data.size() / 2), options, dbg);
      return fault;
    }
    IOStatus Append(const Slice& data, const IOOptions& options, const rocksdb::DataVerificationInfo&,
                    IODebugContext* dbg) override {
      return Append(data, options, dbg);
    }
    IOStatus Sync(const IOOptions& options, IODebugContext* dbg) override {
      const IOStatus fault = disk_->told(disk_->faults_->sync, name_);
      return fault.ok() ? target()->Sync(options, dbg) : fault;
    }
    IOStatus Fsync(const IOOptions& options, IODebugContext* dbg) override { return Sync(options, dbg); }

   private:
    FaultyMapFiles* const disk_;
    const std::string name_;
  };

  class Readable final : public rocksdb::FSRandomAccessFileOwnerWrapper {
   public:
    Readable(FaultyMapFiles* disk, std::string name, std::unique_ptr<rocksdb::FSRandomAccessFile> file)
        : FSRandomAccessFileOwnerWrapper(std::move(file)), disk_(disk), name_(std::move(name)) {}
    IOStatus Read(std::uint64_t offset, std::size_t n, const IOOptions& options, Slice* result, char* scratch,
                  IODebugContext* dbg) const override {
      const IOStatus fault = disk_->told(disk_->faults_->read, name_);
      return fault.ok() ? target()->Read(offset, n, options, result, scratch, dbg) : fault;
    }
    IOStatus MultiRead(rocksdb::FSReadRequest* requests, std::size_t n, const IOOptions& options,
                       IODebugContext* dbg) override {
      const IOStatus fault = disk_->told(disk_->faults_->read, name_);
      return fault.ok() ? target()->MultiRead(requests, n, options, dbg) : fault;
    }

   private:
    FaultyMapFiles* const disk_;
    const std::string name_;
  };

  class Directory final : public rocksdb::FSDirectoryWrapper {
   public:
    Directory(FaultyMapFiles* disk, std::string name, std::unique_ptr<rocksdb::FSDirectory> directory)
        : FSDirectoryWrapper(std::move(directory)), disk_(disk), name_(std::move(name)) {}
    IOStatus FsyncWithDirOptions(const IOOptions& options, IODebugContext* dbg,
                                 const rocksdb::DirFsyncOptions& how) override {
      const IOStatus fault = disk_->told(disk_->faults_->sync, name_);
      return fault.ok() ? FSDirectoryWrapper::FsyncWithDirOptions(options, dbg, how) : fault;
    }

   private:
    FaultyMapFiles* const disk_;
    const std::string name_;
  };

  bool strikes(const std::string& name) const { return name.find(only_) != std::string::npos; }

  // Words errors as the machine's own file system does.
  IOStatus told(const std::atomic<Reason>& reason, const std::string& name) const {
    if (reason == Reason::OK || !strikes(name)) return IOStatus::OK();
    if (reason == Reason::DISK_FULL) return IOStatus::NoSpace(name, std::strerror(ENOSPC));
    return IOStatus::IOError(name, std::strerror(reason == Reason::READ_ONLY ? EROFS : EIO));
  }

  const std::shared_ptr<DiskFaults> faults_;
  const std::string only_;
};

}  // namespace relmap::storage
