#include "tools/relmap-admin/scratch_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "storage/io/open_folder.h"

namespace relmap::admin {

namespace {

namespace fs = std::filesystem;

constexpr const char* kPrefix = "relmap-scratch-";
constexpr const char* kMark = "/SCRATCH";

// -1: the folder has no mark, or another process holds it.
int lock_mark(const std::string& folder, int flags) {
  const int fd = ::open((folder + kMark).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | flags, S_IRUSR | S_IWUSR);
  if (fd < 0 || ::flock(fd, LOCK_EX | LOCK_NB) == 0) return fd;
  ::close(fd);
  return -1;
}

// The mark goes last: a removal that is interrupted is done by the next rehearsal.
void remove_marked(const std::string& folder) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored))
    if ("/" + entry.path().filename().string() != kMark) fs::remove_all(entry.path(), ignored);
  fs::remove_all(folder, ignored);
}

void remove_leftovers(const std::string& parent) {
  std::error_code ignored;
  const auto in = storage::OpenFolder::open(parent);
  if (!in.ok()) return;
  for (const auto& entry : fs::directory_iterator(parent, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kPrefix)) continue;
    const auto folder = (*in)->child(name);
    if (!folder.ok() || !(*folder)->ours()) continue;
    const int lock = lock_mark(entry.path().string(), 0);
    if (lock < 0) continue;
    remove_marked(entry.path().string());
    ::close(lock);
  }
}

}  // namespace

std::string parent_of(const std::string& folder) { return fs::canonical(folder).parent_path().string(); }

Result<std::unique_ptr<ScratchFolder>> ScratchFolder::make(const std::string& parent) {
  remove_leftovers(parent);
  std::string path = fs::absolute(parent).lexically_normal().string();
  path += (path.ends_with('/') ? "" : "/") + std::string(kPrefix) + "XXXXXX";
  const auto failed = [&](const std::string& what) {
    const Reason reason = errno == EACCES || errno == EPERM ? Reason::NOT_ALLOWED : Reason::IO_ERROR;
    return Status(reason, what + ": " + std::strerror(errno));
  };
  if (::mkdtemp(path.data()) == nullptr) return failed("making a scratch folder in " + parent);
  const int lock = lock_mark(path, O_CREAT);
  if (lock < 0) {
    const Status status = failed(path + kMark);
    ::rmdir(path.c_str());
    return status;
  }
  return std::unique_ptr<ScratchFolder>(new ScratchFolder(std::move(path), lock));
}

ScratchFolder::~ScratchFolder() {
  if (!kept_) remove_marked(path_);
  ::close(lock_);
}

void ScratchFolder::keep() {
  std::error_code ignored;
  fs::remove(path_ + kMark, ignored);  // without it the next rehearsal leaves the folder alone
  kept_ = true;
}

}  // namespace relmap::admin
