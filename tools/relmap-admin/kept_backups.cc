#include "tools/relmap-admin/kept_backups.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <optional>

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/rocksdb/folder.h"
#include "storage/rocksdb/partial_folder.h"
#include "storage/rocksdb/recorded_hash.h"
#include "storage/rocksdb/rocksdb_engine.h"

namespace relmap::admin {

namespace {

namespace fs = std::filesystem;

constexpr const char* kTime = "%Y-%m-%dT%H-%M-%SZ";
constexpr std::size_t kTimeSize = 20, kMapDigits = 8;
constexpr const char* kRemoved = ".removed";  // ending of a backup that is being removed

std::string digits_of(const Uuid& map) { return map.to_string().substr(0, kMapDigits); }

std::string time_name(std::int64_t time_s) {
  const std::time_t time = time_s;
  std::tm utc{};
  ::gmtime_r(&time, &utc);
  char text[64];
  return {text, std::strftime(text, sizeof text, kTime, &utc)};
}

// When a backup of this name was begun; nullopt: it is not the name of one.
std::optional<std::int64_t> time_of(const std::string& name) {
  std::tm utc{};
  if (name.size() != kTimeSize + 1 + kMapDigits || ::strptime(name.c_str(), kTime, &utc) == nullptr) return {};
  const std::int64_t time = ::timegm(&utc);
  const bool digits = name.find_first_not_of("0123456789abcdef", kTimeSize + 1) == std::string::npos;
  if (!digits || name[kTimeSize] != '-' || time_name(time) != name.substr(0, kTimeSize)) return {};
  return time;
}

// Names of backups of any map in a folder, ascending, of which each has this ending. What is a link, or no folder, is
// not one.
std::vector<std::string> names_in(const std::string& folder, const std::string& ending) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::string name = entry.path().filename().string();
    if (!name.ends_with(ending) || entry.is_symlink() || !entry.is_directory()) continue;
    name.resize(name.size() - ending.size());
    if (time_of(name)) names.push_back(std::move(name));
  }
  std::sort(names.begin(), names.end());
  return names;
}

// Whether the folder, which this process has locked, holds a backup of the map as it was made.
Status check_backup_of(const Uuid& map, const std::string& folder) {
  storage::RocksDbOptions options;
  options.read_only = true;
  options.locked = true;
  const auto engine = storage::open_rocksdb(folder, options);
  if (!engine.ok()) return engine.status();
  const auto snapshot = (*engine)->snapshot();
  const auto stored = snapshot->get(storage::keys::map_state());
  if (!stored.ok()) return stored.status();
  if (!stored->has_value()) return {Reason::WRONG_MAP, "holds a map without a state"};
  const auto state = storage::decode_state(**stored);
  if (!state.ok()) return {Reason::DATA_LOSS, "the map's state: " + state.status().message()};
  if (state->identity.uuid != map) return {Reason::WRONG_MAP, "holds the map " + state->identity.uuid.to_string()};
  const auto recorded = storage::read_recorded_hash(folder);
  if (recorded.reason() == Reason::CORRUPT) return {Reason::DATA_LOSS, recorded.status().message()};
  if (!recorded.ok()) return recorded.status();
  if (*recorded && (*recorded)->commit != snapshot->commit_number())
    return {Reason::WRONG_STATE, "a daemon has worked on it since it was made"};
  return {};
}

}  // namespace

std::string backup_name(std::int64_t time_s, const Uuid& map) { return time_name(time_s) + "-" + digits_of(map); }

Result<std::string> newest_backup(const std::string& folder) try {
  const std::vector<std::string> names = names_in(folder, "");
  if (names.empty())
    return Status(Reason::NO_SUCH_FILE, folder + " holds neither a map nor backups that `--keep` has made");
  return folder + "/" + names.back();
} catch (const fs::filesystem_error& error) {
  return Status(Reason::NO_SUCH_FILE, error.what());
}

Result<KeptBackups> KeptBackups::open(const std::string& folder, const Uuid& map) try {
  fs::path path = fs::weakly_canonical(fs::absolute(folder));
  if (!path.has_filename()) path = path.parent_path();
  fs::create_directories(path);
  auto opened = storage::OpenFolder::open(path.string());
  if (!opened.ok()) return opened.status();
  if (!(*opened)->private_to_us() || !storage::OpenFolder::is_safe_way(path.string()))
    return Status(Reason::NOT_ALLOWED, "others than this user can change what is in " + path.string() +
                                           ", so nothing is removed there: run this as the user whose folder it is, "
                                           "and let nobody else write to it or to the folders above it");
  return KeptBackups(path.string(), std::move(*opened), map);
} catch (const fs::filesystem_error& error) {
  const bool denied = error.code() == std::errc::permission_denied;
  return Status(denied ? Reason::NOT_ALLOWED : Reason::IO_ERROR, error.what());
} catch (const StatusError& error) {
  return error.status();
}

std::vector<std::string> KeptBackups::names(const std::string& ending) const {
  std::vector<std::string> names = names_in(folder_->path() + "/.", ending);
  std::erase_if(names, [&](const std::string& name) { return !name.ends_with("-" + digits_of(map_)); });
  return names;
}

std::string KeptBackups::next(std::int64_t now_s) const {
  for (const char* ending : {"", ".partial", kRemoved})
    if (const auto there = names(ending); !there.empty()) now_s = std::max(now_s, *time_of(there.back()) + 1);
  return path_ + "/" + backup_name(now_s, map_);
}

Status KeptBackups::thin(std::size_t keep, const std::string& newest,
                         const std::function<void(const std::string& path)>& removed) const try {
  Status failed;
  const std::string newest_name = fs::path(newest).filename().string();
  for (const std::string& name : names(".partial"))
    if (name < newest_name)  // taken over from an interrupted backup, and given up; one that is under way stays
      (void)storage::PartialFolder::begin(path_ + "/" + name, newest);
  for (const std::string& name : names(kRemoved))
    if (Status cleared = clear(name + kRemoved); !cleared.ok()) failed = cleared;
  std::vector<std::string> complete = names("");
  complete.resize(complete.size() - std::min(complete.size(), keep));
  for (const std::string& name : complete) {
    if (Status gone = remove(name); !gone.ok()) {
      failed = {gone.reason(), path_ + "/" + name + " is not removed: " + gone.message()};
      continue;
    }
    removed(path_ + "/" + name);
  }
  return failed;
} catch (const fs::filesystem_error& error) {
  return Status(Reason::IO_ERROR, error.what());
} catch (const StatusError& error) {
  return error.status();
}

// It loses its name first, so that half of it is never taken for a backup.
Status KeptBackups::remove(const std::string& name) const {
  const auto backup = folder_->child(name);
  if (!backup.ok()) return backup.status();
  if (!(*backup)->ours()) return {Reason::NOT_ALLOWED, "it belongs to another user"};
  const auto lock = storage::FolderLock::take((*backup)->path());
  if (lock.reason() == Reason::FOLDER_LOCKED)
    return {Reason::FOLDER_LOCKED, storage::lock_owner((*backup)->path()) + " uses it"};
  if (!lock.ok()) return lock.status();
  if (Status ours = check_backup_of(map_, (*backup)->path()); !ours.ok()) return ours;
  if (Status renamed = folder_->rename(name, name + kRemoved); !renamed.ok()) return renamed;
  if (Status synced = folder_->sync(); !synced.ok()) return synced;
  return clear(name + kRemoved);
}

Status KeptBackups::clear(const std::string& removed_name) const {
  const auto backup = folder_->child(removed_name);
  if (!backup.ok()) return backup.status();
  if (!(*backup)->ours()) return {Reason::NOT_ALLOWED, removed_name + " belongs to another user"};
  (*backup)->clear();
  if (folder_->remove_empty(removed_name)) return {};
  return {Reason::IO_ERROR, "removing " + path_ + "/" + removed_name + ": " + std::strerror(errno)};
}

}  // namespace relmap::admin
