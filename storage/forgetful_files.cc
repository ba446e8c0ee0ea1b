#include "storage/forgetful_files.h"

#include <algorithm>

namespace relmap {
namespace {

Status no_power() { return Status(Reason::IO_ERROR, "the power has failed"); }
Status no_file(const std::string& path) { return Status(Reason::NO_SUCH_FILE, path); }

class BytesFile final : public ReadFile {
 public:
  explicit BytesFile(Bytes bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size() const override { return bytes_.size(); }
  Result<Bytes> read(std::uint64_t offset, std::size_t size) const override {
    if (offset > bytes_.size() || size > bytes_.size() - offset)
      return Status(Reason::IO_ERROR, "a read behind the end");
    const auto begin = bytes_.begin() + static_cast<std::ptrdiff_t>(offset);
    return Bytes(begin, begin + static_cast<std::ptrdiff_t>(size));
  }

 private:
  const Bytes bytes_;
};

bool in_directory(const std::string& path, const std::string& directory) {
  return path.size() > directory.size() + 1 && path.starts_with(directory) && path[directory.size()] == '/' &&
         path.find('/', directory.size() + 1) == std::string::npos;
}

}  // namespace

class ForgetfulAppendFile final : public AppendFile {
 public:
  ForgetfulAppendFile(std::shared_ptr<ForgetfulFiles> files, std::shared_ptr<ForgetfulFiles::Node> node,
                      std::uint64_t life)
      : files_(std::move(files)), node_(std::move(node)), life_(life) {}
  Status append(ByteSpan bytes) override { return files_->append(node_, life_, bytes); }
  Status sync() override { return files_->sync(node_, life_); }

 private:
  const std::shared_ptr<ForgetfulFiles> files_;
  const std::shared_ptr<ForgetfulFiles::Node> node_;
  const std::uint64_t life_;
};

std::shared_ptr<ForgetfulFiles> ForgetfulFiles::create(std::uint64_t seed, bool sync) {
  return std::shared_ptr<ForgetfulFiles>(new ForgetfulFiles(seed, sync));
}

void ForgetfulFiles::fail_power_after(std::uint64_t operations) {
  const std::lock_guard lock(mutex_);
  operations_left_ = operations;
}

bool ForgetfulFiles::has_power() const {
  const std::lock_guard lock(mutex_);
  return power_;
}

bool ForgetfulFiles::spend() {
  if (!power_) return false;
  if (operations_left_ && --*operations_left_ == 0) {
    power_ = false;
    return false;
  }
  return true;
}

void ForgetfulFiles::restart() {
  const std::lock_guard lock(mutex_);
  const auto chance = [this] { return std::uniform_int_distribution<int>(0, 1)(rng_) == 1; };
  // A name made or removed since its folder was synced may have reached the disk or not.
  for (const auto& [path, node] : names_)
    if (!durable_.contains(path) && chance()) durable_[path] = node;
  for (auto it = durable_.begin(); it != durable_.end();) {
    const auto now = names_.find(it->first);
    const bool gone = now == names_.end() || now->second != it->second;
    it = gone && chance() ? durable_.erase(it) : std::next(it);
  }
  // Of bytes not synced some may have, with garbage where a page in their midst has not.
  for (auto& [path, node] : durable_) {
    const std::size_t pending = node->bytes.size() - node->durable;
    const std::size_t kept = pending == 0 ? 0 : std::uniform_int_distribution<std::size_t>(0, pending)(rng_);
    node->bytes.resize(node->durable + kept);
    if (kept > 0 && chance()) {
      const std::size_t at = node->durable + std::uniform_int_distribution<std::size_t>(0, kept - 1)(rng_);
      std::fill(node->bytes.begin() + static_cast<std::ptrdiff_t>(at),
                node->bytes.begin() + static_cast<std::ptrdiff_t>(std::min(at + 64, node->bytes.size())), 0);
    }
    node->durable = node->bytes.size();
  }
  names_ = durable_;
  power_ = true;
  operations_left_.reset();
  ++life_;
}

void ForgetfulFiles::fail_syncs(int count) {
  const std::lock_guard lock(mutex_);
  failing_syncs_ = count;
}

void ForgetfulFiles::damage(const std::string& path, std::uint64_t offset) {
  const std::lock_guard lock(mutex_);
  names_.at(path)->bytes.at(offset) ^= 1;
}

Status ForgetfulFiles::create_directory(const std::string&) { return {}; }

Result<std::vector<std::string>> ForgetfulFiles::list(const std::string& directory) const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [path, node] : names_)
    if (in_directory(path, directory)) names.push_back(path.substr(directory.size() + 1));
  return names;
}

Result<std::unique_ptr<AppendFile>> ForgetfulFiles::open_append(const std::string& path) {
  const std::lock_guard lock(mutex_);
  if (!power_) return no_power();
  auto& node = names_[path];
  if (!node) node = std::make_shared<Node>();
  return std::unique_ptr<AppendFile>(std::make_unique<ForgetfulAppendFile>(shared_from_this(), node, life_));
}

Result<std::unique_ptr<ReadFile>> ForgetfulFiles::open_read(const std::string& path) const {
  const std::lock_guard lock(mutex_);
  if (!power_) return no_power();
  const auto found = names_.find(path);
  if (found == names_.end()) return no_file(path);
  return std::unique_ptr<ReadFile>(std::make_unique<BytesFile>(found->second->bytes));
}

Status ForgetfulFiles::append(const std::shared_ptr<Node>& node, std::uint64_t life, ByteSpan bytes) {
  const std::lock_guard lock(mutex_);
  if (life != life_) return no_power();
  const bool had_power = power_;
  const bool done = spend();
  if (had_power) node->bytes.insert(node->bytes.end(), bytes.begin(), bytes.end());  // how much, restart() decides
  return done ? Status() : no_power();
}

Status ForgetfulFiles::sync(const std::shared_ptr<Node>& node, std::uint64_t life) {
  const std::lock_guard lock(mutex_);
  if (life != life_ || !spend()) return no_power();
  if (failing_syncs_ > 0) {
    --failing_syncs_;
    return Status(Reason::IO_ERROR, "a sync failed, as it was told to");
  }
  if (sync_) node->durable = node->bytes.size();
  return {};
}

Status ForgetfulFiles::truncate(const std::string& path, std::uint64_t size) {
  const std::lock_guard lock(mutex_);
  if (!spend()) return no_power();
  const auto found = names_.find(path);
  if (found == names_.end()) return no_file(path);
  Node& node = *found->second;
  node.bytes.resize(size);
  node.durable = sync_ ? node.bytes.size() : std::min(node.durable, node.bytes.size());
  return {};
}

Status ForgetfulFiles::remove(const std::string& path) {
  const std::lock_guard lock(mutex_);
  if (!spend()) return no_power();
  return names_.erase(path) == 1 ? Status() : no_file(path);
}

Status ForgetfulFiles::sync_directory(const std::string& directory) {
  const std::lock_guard lock(mutex_);
  if (!spend()) return no_power();
  if (!sync_) return {};
  for (const auto& [path, node] : names_)
    if (in_directory(path, directory)) durable_[path] = node;
  std::erase_if(durable_, [&](const auto& entry) {
    return in_directory(entry.first, directory) && !names_.contains(entry.first);
  });
  return {};
}

}  // namespace relmap
