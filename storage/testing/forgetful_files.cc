#include "storage/testing/forgetful_files.h"

#include <algorithm>
#include <array>
#include <utility>

namespace relmap::storage {
namespace {

constexpr std::size_t kSector = 512;  // written whole or not at all

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

bool in_directory(const std::string& path, const std::string& directory) { return folder_of(path) == directory; }

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

// A folder whose name was not durable may be gone, with all that was in it.
void ForgetfulFiles::forget_directories() {
  for (const std::string& directory : directories_) {
    if (durable_directories_.contains(directory)) continue;
    if (chance()) {
      durable_directories_.insert(directory);
      continue;
    }
    const auto inside = [&](const auto& entry) { return entry.first.starts_with(directory + "/"); };
    std::erase_if(names_, inside);
    std::erase_if(durable_, inside);
    std::erase_if(durable_directories_, [&](const std::string& path) { return path.starts_with(directory + "/"); });
  }
  directories_ = durable_directories_;
}

void ForgetfulFiles::restart() {
  const std::lock_guard lock(mutex_);
  forget_directories();
  // A name made or removed since its folder was synced may have reached the disk or not.
  for (const auto& [path, node] : names_)
    if (!durable_.contains(path) && chance()) durable_[path] = node;
  for (auto it = durable_.begin(); it != durable_.end();) {
    const auto now = names_.find(it->first);
    const bool gone = now == names_.end() || now->second != it->second;
    if (!gone || !chance())
      ++it;
    else if (now == names_.end())
      it = durable_.erase(it);
    else
      (it++)->second = now->second;
  }
  for (auto& [path, node] : durable_) {
    node->bytes = node->durable = after_power_failure(*node);
    node->given_up.clear();
  }
  names_ = durable_;
  begin_life();
}

void ForgetfulFiles::kill() {
  const std::lock_guard lock(mutex_);
  begin_life();
}

void ForgetfulFiles::begin_life() {
  power_ = true;
  operations_left_.reset();
  ++life_;
}

// The length and each sector reach the disk independently of each other.
Bytes ForgetfulFiles::after_power_failure(const Node& node) {
  const auto [shorter, longer] = std::minmax({node.durable.size(), node.bytes.size()});
  std::size_t size = chance() ? node.durable.size() : node.bytes.size();
  if (chance()) size = std::uniform_int_distribution<std::size_t>(shorter, longer)(rng_);
  Bytes left = node.durable;
  left.resize(size);
  const double likely = std::array{0.0, 0.5, 0.9, 1.0}[std::uniform_int_distribution<std::size_t>(0, 3)(rng_)];
  for (std::size_t at = 0; at < std::min(size, node.bytes.size()); at += kSector) {
    if (node.given_up.contains(at / kSector) || !std::bernoulli_distribution(likely)(rng_)) continue;
    const auto begin = node.bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const std::size_t length = std::min({kSector, size - at, node.bytes.size() - at});
    std::copy_n(begin, length, left.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return left;
}

std::shared_ptr<ForgetfulFiles> ForgetfulFiles::certain(const std::string& directory) const {
  const auto other = create(0);
  const std::lock_guard lock(mutex_);
  for (const auto& [path, node] : durable_) {
    if (!in_directory(path, directory) || !names_.contains(path)) continue;  // what is removed must not be needed
    other->names_[path] = std::make_shared<Node>(Node{node->durable, node->durable, {}});
  }
  other->durable_ = other->names_;
  return other;
}

void ForgetfulFiles::fail_syncs(int count) {
  const std::lock_guard lock(mutex_);
  failing_syncs_ = count;
}

void ForgetfulFiles::damage(const std::string& path, std::uint64_t offset) {
  const std::lock_guard lock(mutex_);
  Node& node = *names_.at(path);
  node.bytes.at(offset) ^= 1;
  node.durable.at(offset) ^= 1;
}

Status ForgetfulFiles::create_directory(const std::string& path) {
  const std::lock_guard lock(mutex_);
  if (directories_.contains(path)) return {};
  if (!spend()) return no_power();
  directories_.insert(path);
  return {};
}

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
  if (life != life_ || !power_) return no_power();
  const std::size_t first = node->bytes.size() / kSector;
  node->bytes.insert(node->bytes.end(), bytes.begin(), bytes.end());  // restart() decides how much of it stays
  node->given_up.erase(node->given_up.lower_bound(first), node->given_up.end());
  return spend() ? Status() : no_power();
}

Status ForgetfulFiles::sync(const std::shared_ptr<Node>& node, std::uint64_t life) {
  const std::lock_guard lock(mutex_);
  if (life != life_ || !spend()) return no_power();
  return sync_locked(*node);
}

Status ForgetfulFiles::sync_locked(Node& node) {
  if (failing_syncs_ > 0) {
    --failing_syncs_;
    const std::size_t same = static_cast<std::size_t>(
        std::mismatch(node.bytes.begin(), node.bytes.end(), node.durable.begin(), node.durable.end()).first -
        node.bytes.begin());
    for (std::size_t sector = same / kSector; sector * kSector < node.bytes.size(); ++sector)
      node.given_up.insert(sector);
    return Status(Reason::IO_ERROR, "a sync failed, as it was told to");
  }
  if (!sync_) return {};
  Bytes before = std::exchange(node.durable, node.bytes);
  before.resize(node.bytes.size());
  for (const std::size_t sector : node.given_up) {
    const std::size_t at = sector * kSector;
    if (at >= before.size()) continue;
    std::copy_n(before.begin() + static_cast<std::ptrdiff_t>(at), std::min(kSector, before.size() - at),
                node.durable.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return {};
}

Status ForgetfulFiles::truncate(const std::string& path, std::uint64_t size) {
  const std::lock_guard lock(mutex_);
  const bool had_power = power_;
  const bool done = spend();
  const auto found = names_.find(path);
  if (had_power && found != names_.end() && (done || chance())) found->second->bytes.resize(size);
  if (!done) return no_power();
  return found == names_.end() ? no_file(path) : sync_locked(*found->second);
}

Status ForgetfulFiles::remove(const std::string& path) {
  const std::lock_guard lock(mutex_);
  const bool had_power = power_;
  const bool done = spend();
  const bool there = had_power && (done || chance()) && names_.erase(path) == 1;
  if (!done) return no_power();
  return there ? Status() : no_file(path);
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
  for (const std::string& path : directories_)
    if (in_directory(path, directory)) durable_directories_.insert(path);
  return {};
}

Result<DiskRoom> ForgetfulFiles::room(const std::string&) const {
  constexpr std::uint64_t kAmple = std::uint64_t{1} << 40;
  return DiskRoom{kAmple, kAmple};
}

Status ForgetfulFiles::occupy(const std::string& path, std::uint64_t bytes) {
  if (Status opened = open_append(path).status(); !opened.ok()) return opened;
  const std::lock_guard lock(mutex_);
  names_[path]->bytes.resize(bytes);
  return {};
}

}  // namespace relmap::storage
