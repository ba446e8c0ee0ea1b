#include "tests/file_faults/disk_model.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <stdexcept>

namespace relmap::testing {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kSector = 512;

std::string without_zeros_at_its_end(std::string bytes) {
  const std::size_t last = bytes.find_last_not_of('\0');
  bytes.resize(last == std::string::npos ? 0 : last + 1);
  return bytes;
}

}  // namespace

DiskModel::DiskModel(const std::string& folder) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, NodePointer> known;
  root_ = read(folder, known);
}

DiskModel::NodePointer DiskModel::read(const std::string& path,
                                       std::map<std::pair<std::uint64_t, std::uint64_t>, NodePointer>& known) {
  struct stat facts {};
  if (::lstat(path.c_str(), &facts) != 0) throw std::runtime_error("cannot look at " + path);
  if (!S_ISDIR(facts.st_mode) && !S_ISREG(facts.st_mode)) return nullptr;
  NodePointer& node = known[{facts.st_dev, facts.st_ino}];
  if (node) return node;
  node = std::make_shared<Node>();
  const NodePointer made = node;
  made->folder = S_ISDIR(facts.st_mode);
  if (made->folder) {
    folders_.push_back(made);
    for (const auto& entry : fs::directory_iterator(path))
      if (NodePointer child = read(entry.path().string(), known)) made->names[entry.path().filename().string()] = child;
    made->durable_names = made->names;
    return made;
  }
  std::ostringstream bytes;
  if (facts.st_size > 0) bytes << std::ifstream(path, std::ios::binary).rdbuf();
  made->now = made->durable = {without_zeros_at_its_end(bytes.str()), static_cast<std::uint64_t>(facts.st_size)};
  return made;
}

DiskModel::NodePointer DiskModel::find(const std::string& path) const {
  NodePointer at = root_;
  std::istringstream parts(path);
  for (std::string part; std::getline(parts, part, '/');) {
    const auto found = at->names.find(part);
    if (found == at->names.end()) return nullptr;
    at = found->second;
  }
  return at;
}

DiskModel::NodePointer DiskModel::find_there(const std::string& path) const {
  NodePointer node = find(path);
  if (!node) throw std::runtime_error("there is no " + path);
  return node;
}

std::pair<DiskModel::Node*, std::string> DiskModel::place(const std::string& path) const {
  const std::size_t slash = path.rfind('/');
  const NodePointer folder = find(slash == std::string::npos ? "" : path.substr(0, slash));
  if (!folder || !folder->folder) throw std::runtime_error("there is no folder for " + path);
  return {folder.get(), slash == std::string::npos ? path : path.substr(slash + 1)};
}

DiskModel::NodePointer DiskModel::open_file(int fd) const {
  const auto found = open_.find(fd);
  if (found == open_.end()) throw std::runtime_error("descriptor " + std::to_string(fd) + " is not open");
  return found->second;
}

void DiskModel::apply(const FileOperation& operation) {
  switch (operation.kind) {
    case OperationKind::kOpen: {
      NodePointer node = find(operation.path);
      if (!node) {
        if ((operation.flags & O_CREAT) == 0) throw std::runtime_error("there is no " + operation.path);
        node = std::make_shared<Node>();
        const auto [folder, name] = place(operation.path);
        rename({{folder, name, node}});
      }
      if ((operation.flags & O_TRUNC) != 0 && node->now.size > 0) change(*node, {true, 0});
      open_[operation.fd] = node;
      return;
    }
    case OperationKind::kClose:
      open_.erase(operation.fd);
      return;
    case OperationKind::kDuplicate:
      open_[operation.flags] = open_file(operation.fd);
      return;
    case OperationKind::kWrite:
      return change(*open_file(operation.fd), {false, operation.offset, operation.bytes});
    case OperationKind::kResize:
      return change(*open_file(operation.fd), {true, operation.offset});
    case OperationKind::kResizeAt:
      return change(*find_there(operation.path), {true, operation.offset});
    case OperationKind::kExtend: {
      const NodePointer node = open_file(operation.fd);
      if (operation.offset > node->now.size) change(*node, {true, operation.offset});
      return;
    }
    case OperationKind::kSync:
      return sync(*open_file(operation.fd));
    case OperationKind::kFailedSync:
      return fail_sync(*open_file(operation.fd));
    case OperationKind::kRename: {
      const auto [from, from_name] = place(operation.path);
      const auto [to, to_name] = place(operation.other);
      const NodePointer node = find_there(operation.path);
      const bool exchange = (static_cast<unsigned>(operation.flags) & RENAME_EXCHANGE) != 0;
      return rename({{to, to_name, node}, {from, from_name, exchange ? find_there(operation.other) : nullptr}});
    }
    case OperationKind::kLink: {
      const auto [folder, name] = place(operation.other);
      return rename({{folder, name, find_there(operation.path)}});
    }
    case OperationKind::kRemove: {
      (void)find_there(operation.path);
      const auto [folder, name] = place(operation.path);
      return rename({{folder, name, nullptr}});
    }
    case OperationKind::kMakeFolder: {
      const auto made = std::make_shared<Node>();
      made->folder = true;
      folders_.push_back(made);
      const auto [folder, name] = place(operation.path);
      return rename({{folder, name, made}});
    }
  }
}

void DiskModel::rename(std::vector<NewName> names) {
  Renaming renaming;
  for (const NewName& name : names) {
    if (name.node)
      name.folder->names[name.name] = name.node;
    else
      name.folder->names.erase(name.name);
    renaming.unsynced.insert(name.folder);
  }
  renaming.names = std::move(names);
  renamings_.push_back(std::move(renaming));
}

void DiskModel::change(Content& content, const Change& change) {
  if (!change.resize) {
    const std::uint64_t end = change.offset + change.bytes.size();
    if (content.bytes.size() < end) content.bytes.resize(end);
    content.bytes.replace(change.offset, change.bytes.size(), change.bytes);
    content.size = std::max(content.size, end);
    return;
  }
  content.size = change.offset;
  if (content.bytes.size() > content.size) content.bytes.resize(content.size);
}

void DiskModel::change(Node& node, Change change) {
  DiskModel::change(node.now, change);
  node.changes.push_back(std::move(change));
}

bool DiskModel::share_a_name(const Renaming& a, const Renaming& b) {
  return std::any_of(a.names.begin(), a.names.end(), [&](const NewName& mine) {
    return std::any_of(b.names.begin(), b.names.end(),
                       [&](const NewName& other) { return mine.folder == other.folder && mine.name == other.name; });
  });
}

void DiskModel::sync(Node& node) {
  if (!node.folder) {
    node.durable = node.now;
    node.changes.clear();
    return;
  }
  for (Renaming& renaming : renamings_) renaming.unsynced.erase(&node);
  // A name is not durable before what happened to the same name earlier.
  for (auto later = renamings_.rbegin(); later != renamings_.rend(); ++later)
    if (later->unsynced.empty())
      for (auto earlier = std::next(later); earlier != renamings_.rend(); ++earlier)
        if (share_a_name(*earlier, *later)) earlier->unsynced.clear();
  std::erase_if(renamings_, [](const Renaming& renaming) {
    if (!renaming.unsynced.empty()) return false;
    for (const NewName& name : renaming.names)
      if (name.node)
        name.folder->durable_names[name.name] = name.node;
      else
        name.folder->durable_names.erase(name.name);
    return true;
  });
}

void DiskModel::fail_sync(Node& node) {
  if (node.folder) return;
  const bool a_part = std::bernoulli_distribution(0.5)(random_);
  node.now = node.durable = remains(node, a_part ? Survives::kSome : Survives::kDurable, random_);
  node.changes.clear();
}

DiskModel::Content DiskModel::remains(const Node& node, Survives survives, std::mt19937_64& random) {
  if (survives == Survives::kEverything) return node.now;
  if (survives == Survives::kDurable || node.changes.empty()) return node.durable;
  const auto pick = [&](std::size_t most) { return std::uniform_int_distribution<std::size_t>(0, most)(random); };
  // The lengths of all moments, and any between two, for a long write reaches the disk piece by piece.
  std::vector<std::uint64_t> sizes{node.durable.size};
  std::uint64_t size = node.durable.size;
  for (const Change& step : node.changes) {
    size = step.resize ? step.offset : std::max(size, step.offset + step.bytes.size());
    sizes.push_back(size);
  }
  const std::size_t moment = pick(sizes.size() - 1);
  size = sizes[moment];
  if (moment > 0 && size > sizes[moment - 1] && pick(3) == 0) {
    const std::uint64_t cut = (sizes[moment - 1] + pick(size - sizes[moment - 1])) / kSector * kSector;
    size = std::max(cut, sizes[moment - 1]);
  }
  // Each sector as it was at a moment of its own. Only those that were changed are looked at.
  Content left{node.durable.bytes.substr(0, size), size};
  std::map<std::uint64_t, std::vector<const Change*>> touched;
  for (const Change& step : node.changes) {
    const std::uint64_t end = step.resize ? std::max<std::uint64_t>(node.durable.bytes.size(), node.now.bytes.size())
                                          : step.offset + step.bytes.size();
    for (std::uint64_t sector = step.offset / kSector; sector * kSector < end; ++sector)
      touched[sector].push_back(&step);
  }
  for (const auto& [sector, steps] : touched) {
    const std::uint64_t begin = sector * kSector;
    if (begin >= size) break;
    std::string bytes(kSector, '\0');
    if (begin < node.durable.bytes.size()) {
      const std::string old = node.durable.bytes.substr(begin, kSector);
      bytes.replace(0, old.size(), old);
    }
    const std::size_t through = pick(steps.size());
    for (std::size_t i = 0; i < through; ++i) {
      const std::uint64_t from = std::max(begin, steps[i]->offset) - begin;
      if (steps[i]->resize) {
        if (steps[i]->offset < begin + kSector)
          std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(from), bytes.end(), '\0');
        continue;
      }
      const std::uint64_t skip = begin + from - steps[i]->offset;
      const std::uint64_t count = std::min(kSector - from, steps[i]->bytes.size() - skip);
      bytes.replace(from, count, steps[i]->bytes, skip, count);
    }
    bytes.resize(std::min(kSector, size - begin));
    if (left.bytes.size() < begin + bytes.size()) left.bytes.resize(begin + bytes.size());
    left.bytes.replace(begin, bytes.size(), bytes);
  }
  return left;
}

void DiskModel::lay_out(const std::string& folder, Survives survives, std::uint64_t seed) const {
  std::mt19937_64 random(seed);
  // How much survives differs from one failure to the next.
  const double likely = std::uniform_real_distribution<double>(0.05, 0.95)(random);
  std::map<const Node*, Names> changed;  // names of folders, where they are not the durable ones
  std::vector<const Renaming*> lost;
  for (const Renaming& renaming : renamings_) {
    if (survives == Survives::kDurable) break;
    const bool possible = std::none_of(lost.begin(), lost.end(),
                                       [&](const Renaming* earlier) { return share_a_name(*earlier, renaming); });
    if (survives == Survives::kSome && (!possible || !std::bernoulli_distribution(likely)(random))) {
      lost.push_back(&renaming);
      continue;
    }
    for (const NewName& name : renaming.names) {
      Names& names = changed.try_emplace(name.folder, name.folder->durable_names).first->second;
      if (name.node)
        names[name.name] = name.node;
      else
        names.erase(name.name);
    }
  }
  std::map<const Node*, std::string> written;  // files may have several names
  const std::function<void(const Node&, const std::string&)> write = [&](const Node& node, const std::string& path) {
    if (node.folder) {
      fs::create_directories(path);
      fs::permissions(path, fs::perms::owner_all);
      const auto other = changed.find(&node);
      for (const auto& [name, child] : other == changed.end() ? node.durable_names : other->second)
        write(*child, path + "/" + name);
      return;
    }
    if (const auto known = written.find(&node); known != written.end())
      return fs::create_hard_link(known->second, path);
    written[&node] = path;
    const Content content = remains(node, survives, random);
    std::ofstream(path, std::ios::binary)
        .write(content.bytes.data(), static_cast<std::streamsize>(content.bytes.size()));
    fs::resize_file(path, content.size);
  };
  write(*root_, folder);
}

}  // namespace relmap::testing
