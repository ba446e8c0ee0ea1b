// Files in memory that behave as those of a machine do whose power fails. Any part of what was not synced may be
// forgotten: a sector may be written although an earlier one is not; a file may have its new length and zeros in it; a
// name that was made or removed, even that of a folder with all that is in it, may or may not stand until the folder
// that holds it is synced. And as on Linux, a sync that failed has dropped its bytes: the next one succeeds without
// them. Operations can also be made to fail on demand.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <set>

#include "storage/io/file.h"

namespace relmap::storage {

// Thread-safe.
class ForgetfulFiles final : public FileSystem, public std::enable_shared_from_this<ForgetfulFiles> {
 public:
  // `sync == false`: syncs return at once and make nothing durable.
  static std::shared_ptr<ForgetfulFiles> create(std::uint64_t seed, bool sync = true);

  // The power fails at the n-th operation from now (1: the next) that writes, syncs, truncates or removes: it happens
  // in part or not at all, and all later ones fail, until restart().
  void fail_power_after(std::uint64_t operations);
  bool has_power() const;
  // The power comes back. What was not durable is forgotten by chance. Files that were open can no longer be used.
  void restart();
  // The process that wrote is killed, and the machine keeps its memory: like restart(), but nothing is forgotten.
  void kill();
  // Another disk, which has of this folder only what is certain to survive a power failure now.
  std::shared_ptr<ForgetfulFiles> certain(const std::string& directory) const;
  // Each of the next `count` syncs of a file fails with IO_ERROR.
  void fail_syncs(int count);
  // Flips a bit that has long been durable.
  void damage(const std::string& path, std::uint64_t offset);

  Status create_directory(const std::string& path) override;
  Result<std::vector<std::string>> list(const std::string& directory) const override;
  Result<std::unique_ptr<AppendFile>> open_append(const std::string& path) override;
  Result<std::unique_ptr<ReadFile>> open_read(const std::string& path) const override;
  Status truncate(const std::string& path, std::uint64_t size) override;
  Status remove(const std::string& path) override;
  Status sync_directory(const std::string& path) override;
  Result<DiskRoom> room(const std::string& directory) const override;
  Status occupy(const std::string& path, std::uint64_t bytes) override;

 private:
  friend class ForgetfulAppendFile;
  struct Node {
    Bytes bytes;                     // as the running machine sees them
    Bytes durable;                   // as they are on the disk for certain
    std::set<std::size_t> given_up;  // sectors whose bytes a failed sync has dropped: durable only if written again
  };

  ForgetfulFiles(std::uint64_t seed, bool sync) : sync_(sync), rng_(seed) {}
  bool chance() { return std::uniform_int_distribution<int>(0, 1)(rng_) == 1; }
  void forget_directories();
  void begin_life();
  bool spend();  // one operation; false: the power fails at it or has failed
  Bytes after_power_failure(const Node& node);
  Status append(const std::shared_ptr<Node>& node, std::uint64_t life, ByteSpan bytes);
  Status sync(const std::shared_ptr<Node>& node, std::uint64_t life);
  Status sync_locked(Node& node);

  const bool sync_;
  mutable std::mutex mutex_;
  std::mt19937_64 rng_;
  std::map<std::string, std::shared_ptr<Node>> names_;    // as the running machine sees them
  std::map<std::string, std::shared_ptr<Node>> durable_;  // as the disk has them
  // Folders that were created here, as the machine sees them and as the disk has them. Folders that were not created
  // here have always existed.
  std::set<std::string> directories_, durable_directories_;
  std::optional<std::uint64_t> operations_left_;
  bool power_ = true;
  std::uint64_t life_ = 0;  // restarts so far
  int failing_syncs_ = 0;
};

}  // namespace relmap::storage
