// Files in memory that behave as a machine's do when its power fails: what was not synced is forgotten, wholly or in
// part, and so are the names of files whose folder was not synced. Also fails operations on demand.
#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <random>

#include "storage/file.h"

namespace relmap {

// Thread-safe.
class ForgetfulFiles final : public FileSystem, public std::enable_shared_from_this<ForgetfulFiles> {
 public:
  // `sync == false`: syncs return at once and make nothing durable.
  static std::shared_ptr<ForgetfulFiles> create(std::uint64_t seed, bool sync = true);

  // The power fails at the n-th operation from now (1: the next) that writes, syncs, truncates or removes: it happens
  // in part or not at all, and all later ones fail, until restart().
  void fail_power_after(std::uint64_t operations);
  bool has_power() const;
  // The power comes back; what was not durable is forgotten, as chance has it. Open files are dead.
  void restart();
  // Each of the next `count` syncs fails with IO_ERROR, and its bytes stay volatile.
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

 private:
  friend class ForgetfulAppendFile;
  struct Node {
    Bytes bytes;              // as the running machine sees them
    std::size_t durable = 0;  // so many of them survive for certain
  };

  ForgetfulFiles(std::uint64_t seed, bool sync) : sync_(sync), rng_(seed) {}
  bool spend();  // one operation; false: the power fails at it or has failed
  Status append(const std::shared_ptr<Node>& node, std::uint64_t life, ByteSpan bytes);
  Status sync(const std::shared_ptr<Node>& node, std::uint64_t life);

  const bool sync_;
  mutable std::mutex mutex_;
  std::mt19937_64 rng_;
  std::map<std::string, std::shared_ptr<Node>> names_;    // as the running machine sees them
  std::map<std::string, std::shared_ptr<Node>> durable_;  // as the disk has them
  std::optional<std::uint64_t> operations_left_;
  bool power_ = true;
  std::uint64_t life_ = 0;  // restarts so far
  int failing_syncs_ = 0;
};

}  // namespace relmap
