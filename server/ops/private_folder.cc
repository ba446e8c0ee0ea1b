#include "server/ops/private_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "server/rpc/listener.h"

namespace relmap::ops {

namespace {

namespace fs = std::filesystem;

constexpr uid_t kSameUser = static_cast<uid_t>(-1);

Status set(const std::string& path, const std::string& group, mode_t mode) {
  if (!group.empty()) {
    const auto id = rpc::group_of(group);
    if (!id.ok()) return id.status();
    if (chown(path.c_str(), kSameUser, *id) != 0)
      return {Reason::IO_ERROR, "cannot give " + path + " to group " + group + ": " + std::strerror(errno)};
  }
  if (chmod(path.c_str(), mode) != 0)
    return {Reason::IO_ERROR, "cannot set the mode of " + path + ": " + std::strerror(errno)};
  return {};
}

}  // namespace

Status make_private(const std::string& folder, const std::string& group) {
  if (Status closed = set(folder, "", S_IRWXU); !closed.ok()) return closed;
  constexpr fs::perms kOthers = fs::perms::group_all | fs::perms::others_all;
  std::error_code error;
  for (auto at = fs::recursive_directory_iterator(folder, error); !error && at != end(at); at.increment(error))
    if (!at->is_symlink(error) && (at->symlink_status(error).permissions() & kOthers) != fs::perms::none)
      fs::permissions(at->path(), kOthers, fs::perm_options::remove, error);
  if (error) return {Reason::IO_ERROR, "cannot close all of " + folder + " to others: " + error.message()};
  return group.empty() ? Status() : set(folder, group, S_IRWXU | S_IXGRP);
}

Status share_with_group(const std::string& file, const std::string& group) {
  return set(file, group, S_IRUSR | S_IWUSR | S_IRGRP);
}

}  // namespace relmap::ops
