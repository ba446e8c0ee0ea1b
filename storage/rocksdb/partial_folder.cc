#include "storage/rocksdb/partial_folder.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>

#include "storage/io/file.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;

// The file in DIR.partial that shows what the folder is.
constexpr const char* kMark = "/PARTIAL";
constexpr const char* kMarkText = "relmap partial folder 1\n";

// Without ".." and without a slash at its end, so that a suffix can be appended.
fs::path plain(const fs::path& path) { return path.has_filename() ? path : path.parent_path(); }

// Whether `path`, which need not exist, is `folder` or lies in it, also by another name, such as one that a mount
// gives.
bool is_within(fs::path path, const fs::path& folder) {
  for (;; path = path.parent_path()) {
    if (path == folder || (fs::exists(path) && fs::equivalent(path, folder))) return true;
    if (path == path.parent_path()) return false;
  }
}

Status check_apart(const std::string& directory, const std::string& source) {
  const fs::path map = fs::canonical(source);
  for (const fs::path& copy : {fs::path(directory), fs::path(directory + ".partial")}) {
    if (is_within(copy, map))
      return Status(Reason::INVALID_ARGUMENT,
                    copy.string() + " lies in " + map.string() + ", the folder that is to be copied");
    if (fs::exists(copy) && is_within(map, copy))
      return Status(Reason::INVALID_ARGUMENT,
                    map.string() + ", the folder that is to be copied, lies in " + copy.string());
  }
  return {};
}

// The folder in which `directory` is to be made, below the root, without following a link. Folders on the way are made.
Result<std::unique_ptr<OpenFolder>> parent_below(const fs::path& root, const fs::path& directory) {
  auto at = OpenFolder::open(root.string());
  if (!at.ok()) return at.status();
  for (const fs::path& way : {root, fs::canonical(root)})
    if (!OpenFolder::is_safe_way(way.string()))
      return Status(Reason::NOT_ALLOWED,
                    "others can change where " + root.string() + " leads to: no backup is made there");
  fs::path name = root;
  const fs::path below = directory.lexically_relative(root).parent_path();
  for (auto step = below.begin();; ++step) {
    if (!(*at)->private_to_us())
      return Status(Reason::NOT_ALLOWED, "others can change what is in " + name.string() + ": no backup is made there");
    if (step == below.end()) return at;
    name /= *step;
    auto next = (*at)->make(step->string());
    if (!next.ok()) return Status(next.reason(), name.string() + ": " + next.status().message());
    at = std::move(next);
  }
}

Result<std::unique_ptr<OpenFolder>> parent_of(const fs::path& directory, const std::vector<std::string>& roots) {
  if (roots.empty()) {
    fs::create_directories(directory.parent_path());
    return OpenFolder::open(directory.parent_path().string());
  }
  std::string all;
  for (const std::string& given : roots) {
    const fs::path root = plain(fs::path(given).lexically_normal());
    for (const fs::path& name : {root, fs::weakly_canonical(root)}) {  // a root itself may be a link
      const fs::path relative = directory.lexically_relative(name);
      if (!relative.empty() && *relative.begin() != ".." && *relative.begin() != ".")
        return parent_below(name, directory);
    }
    all += (all.empty() ? "" : ", ") + root.string();
  }
  return Status(Reason::NOT_ALLOWED, directory.string() + " is not below a folder for backups: " + all);
}

std::string mark_of(const OpenFolder& folder) {
  std::ifstream mark(folder.path() + kMark);
  return {std::istreambuf_iterator<char>(mark), {}};
}

// Its mark says so, or nothing is in it but the beginning of one, which after a power failure may be zeros.
bool is_leftover(const OpenFolder& folder) {
  if (!folder.ours()) return false;
  const std::string text = mark_of(folder);
  if (text.starts_with(kMarkText)) return true;
  const auto entries = fs::directory_iterator(folder.path() + "/.");
  return std::string_view(kMarkText).starts_with(text.substr(0, text.find('\0'))) &&
         std::all_of(begin(entries), end(entries),
                     [](const fs::directory_entry& entry) { return "/" + entry.path().filename().string() == kMark; });
}

// The mark is durable before anything else is in the folder: a power failure must not leave the rest without it.
Status write_mark(const OpenFolder& folder) {
  const std::string path = folder.path() + kMark;
  const bool whole = mark_of(folder).starts_with(kMarkText);
  if (!whole) fs::remove(path);
  const auto file = posix_file_system()->open_append(path);
  if (!file.ok()) return file.status();
  if (!whole)
    if (Status written = (*file)->append(as_bytes(kMarkText)); !written.ok()) return written;
  if (Status synced = (*file)->sync(); !synced.ok()) return synced;
  return folder.sync();
}

}  // namespace

std::string PartialFolder::final_name() const { return fs::path(directory_).filename().string(); }

Result<std::unique_ptr<PartialFolder>> PartialFolder::begin(const NewFolder& to, const std::string& source) try {
  // Where any folder will do, links may lead to it.
  const fs::path given = fs::absolute(to.path);
  const fs::path directory = plain(to.roots.empty() ? fs::weakly_canonical(given) : given.lexically_normal());
  if (Status apart = check_apart(directory, source); !apart.ok()) return apart;
  auto parent = parent_of(directory, to.roots);
  if (!parent.ok()) return parent.status();
  // What was looked at by name may be another folder by now.
  const std::string name = directory.filename();
  if (Status apart = check_apart(fs::path((*parent)->name()) / name, source); !apart.ok()) return apart;
  if (auto there = (*parent)->child(name); there.reason() == Reason::NOT_ALLOWED)
    return Status(Reason::INVALID_ARGUMENT, directory.string() + " is a link, or no folder");
  else if (there.ok() ? !(*there)->empty() : there.reason() != Reason::NO_SUCH_FILE)
    return there.ok() ? Status(Reason::INVALID_ARGUMENT, directory.string() + " exists and is not an empty folder")
                      : there.status();
  const std::string partial = name + ".partial";
  auto own = (*parent)->make(partial);
  const std::string in_the_way =
      directory.string() + ".partial is in the way: it is not what an interrupted attempt left";
  if (own.reason() == Reason::NOT_ALLOWED) return Status(Reason::INVALID_ARGUMENT, in_the_way);
  if (!own.ok()) return own.status();
  if (!is_leftover(**own)) return Status(Reason::INVALID_ARGUMENT, in_the_way);
  if (Status restricted = (*own)->restrict_to_owner(); !restricted.ok()) return restricted;
  std::unique_ptr<PartialFolder> folder(new PartialFolder(std::move(*parent), std::move(*own), directory));
  if (Status marked = write_mark(*folder->own_); !marked.ok()) return folder->named(marked);
  auto lock = FolderLock::take(folder->path());
  if (!lock.ok()) {
    folder->completed_ = true;  // it is another's
    if (lock.reason() != Reason::FOLDER_LOCKED) return folder->named(lock.status());
    return Status(Reason::FOLDER_LOCKED, directory.string() + ".partial is being written by another process");
  }
  folder->lock_ = std::move(*lock);
  for (const auto& entry : fs::directory_iterator(folder->path() + "/."))
    if (const auto file = entry.path().filename(); file != "LOCK" && "/" + file.string() != kMark)
      fs::remove_all(entry.path());
  return folder;
} catch (const fs::filesystem_error& error) {
  return Status(Reason::IO_ERROR, error.what());
} catch (const StatusError& error) {
  return error.status();
}

PartialFolder::~PartialFolder() {
  if (completed_) return;
  own_->clear(&kMark[1]);  // the mark goes last, or a power failure could leave the rest without it
  (void)own_->sync();
  own_->clear();
  const std::string partial = final_name() + ".partial";
  if (parent_->has(partial, *own_)) parent_->remove_empty(partial);
}

Status PartialFolder::named(const Status& status) const {
  std::string message = status.message();
  for (std::size_t at; (at = message.find(path_)) != std::string::npos;)
    message.replace(at, path_.size(), directory_ + ".partial");
  return {status.reason(), message};
}

Status PartialFolder::complete() try {
  const std::string partial = final_name() + ".partial";
  for (const auto& entry : fs::recursive_directory_iterator(path_ + "/."))
    if (entry.is_directory())
      if (Status synced = posix_file_system()->sync_directory(entry.path().string()); !synced.ok())
        return named(synced);
  if (Status synced = own_->sync(); !synced.ok()) return synced;
  if (!parent_->has(partial, *own_))
    return Status(Reason::IO_ERROR, directory_ + ".partial was moved, or replaced by something else");
  parent_->remove_empty(final_name());
  if (Status renamed = parent_->rename(partial, final_name()); !renamed.ok()) return renamed;
  if (!parent_->has(final_name(), *own_))
    return Status(Reason::IO_ERROR, directory_ + " was replaced by something else");
  completed_ = true;
  if (Status synced = parent_->sync(); !synced.ok()) return synced;
  fs::remove(path_ + kMark);
  return own_->sync();
} catch (const fs::filesystem_error& error) {
  return Status(Reason::IO_ERROR, error.what());
} catch (const StatusError& error) {
  return error.status();
}

}  // namespace relmap::storage
