#include "server/ops/private_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "server/rpc/listener.h"

namespace relmap::ops {

namespace {

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
  return set(folder, group, group.empty() ? S_IRWXU : S_IRWXU | S_IXGRP);
}

Status share_with_group(const std::string& file, const std::string& group) {
  return set(file, group, S_IRUSR | S_IWUSR | S_IRGRP);
}

}  // namespace relmap::ops
