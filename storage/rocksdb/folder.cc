#include "storage/rocksdb/folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "storage/io/file.h"
#include "storage/journal/journal_segment.h"

namespace relmap::storage {
namespace {

constexpr const char* kProduct = "relmap map";

Status failed(const std::string& what) {
  const Reason reason = errno == EROFS ? Reason::READ_ONLY : errno == ENOSPC ? Reason::DISK_FULL : Reason::IO_ERROR;
  return Status(reason, what + ": " + std::strerror(errno));
}

namespace fs = std::filesystem;

// What a first start makes before FORMAT is in the folder, and what a file system has in its root.
bool may_be_in_a_new_folder(const std::string& name) {
  return name == "LOCK" || name == "FORMAT.new" || name == "lost+found" || name == "PARTIAL";
}

// Whether a map's own files are there: the database's, or segments of the journal.
bool has_parts_of_a_map(const std::string& directory) {
  std::error_code error;
  if (fs::exists(directory + "/map/CURRENT", error)) return true;
  for (const auto& entry : fs::directory_iterator(directory + "/map", error))
    if (const auto kind = entry.path().extension(); kind == ".sst" || kind == ".blob") return true;
  for (const auto& entry : fs::directory_iterator(directory + "/journal", error))
    if (SegmentName::parse(entry.path().filename().string())) return true;
  return false;
}

// "a.jpg, b.jpg and 12 more"
std::string list_of(std::vector<std::string> names) {
  constexpr std::size_t kNamed = 3;
  std::sort(names.begin(), names.end());
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kNamed); ++i) text += (i == 0 ? "" : ", ") + names[i];
  return names.size() > kNamed ? text + " and " + std::to_string(names.size() - kNamed) + " more" : text;
}

}  // namespace

Status check_folder(const std::string& directory) {
  std::error_code error;
  if (fs::exists(directory + "/FORMAT", error)) return read_format(directory).status();
  if (!fs::is_directory(directory, error)) return {};
  std::vector<std::string> foreign;
  for (fs::directory_iterator it(directory, error), end; !error && it != end; it.increment(error))
    if (const std::string name = it->path().filename().string(); !may_be_in_a_new_folder(name)) foreign.push_back(name);
  if (error) return Status(Reason::IO_ERROR, "cannot read the folder " + directory + ": " + error.message());
  if (foreign.empty()) return {};
  if (has_parts_of_a_map(directory))
    return Status(Reason::UNKNOWN_FORMAT_VERSION, directory + " holds a map, but no " + directory + "/FORMAT");
  return Status(Reason::NOT_A_MAP, directory + " is neither empty nor the data folder of a map: it holds " +
                                       list_of(std::move(foreign)) + "; a map needs a folder of its own");
}

Result<std::unique_ptr<FolderLock>> FolderLock::take(const std::string& directory) {
  const std::string path = directory + "/LOCK";
  int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (fd < 0 && (errno == EROFS || errno == EACCES)) fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return failed(path);
  std::unique_ptr<FolderLock> lock(new FolderLock(fd));
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return failed(path);
    return Status(Reason::FOLDER_LOCKED, directory + " is owned by " + lock_owner(directory));
  }
  const std::string owner = std::to_string(::getpid()) + "\n";  // for people only: it may fail
  if (::ftruncate(fd, 0) == 0) (void)!::pwrite(fd, owner.data(), owner.size(), 0);
  return lock;
}

Result<std::unique_ptr<FolderLock>> FolderLock::take_unwritten(const std::string& directory) {
  const std::string path = directory + "/LOCK";
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0 && errno != ENOENT) return failed(path);
  std::unique_ptr<FolderLock> lock(new FolderLock(fd));
  if (fd < 0 || ::flock(fd, LOCK_EX | LOCK_NB) == 0) return lock;
  if (errno != EWOULDBLOCK) return failed(path);
  return Status(Reason::FOLDER_LOCKED, directory + " is owned by " + lock_owner(directory));
}

std::string lock_owner(const std::string& directory) {
  long long process = 0;
  std::ifstream(directory + "/LOCK") >> process;
  return process > 0 ? "process " + std::to_string(process) : "another process";
}

FolderLock::~FolderLock() {
  if (fd_ >= 0) ::close(fd_);
}

Result<int> read_format(const std::string& directory) {
  const std::string path = directory + "/FORMAT";
  std::ifstream in(path);
  if (!in) return 0;
  std::string line;
  std::getline(in, line);
  int format = 0, end = 0;
  if (std::sscanf(line.c_str(), "relmap map %9d%n", &format, &end) == 1 && end == static_cast<int>(line.size()) &&
      format > 0)
    return format;
  return Status(Reason::UNKNOWN_FORMAT_VERSION, path + " says \"" + line + "\"");
}

Status check_format(const std::string& directory, bool read_only, int format) {
  const auto found = read_format(directory);
  if (!found.ok()) return found.status();
  if (*found == format) return {};
  if (*found != 0)
    return Status(Reason::UNKNOWN_FORMAT_VERSION,
                  directory + " holds a map of format " + std::to_string(*found) + ", this build reads format " +
                      std::to_string(format) +
                      (*found < format ? "; `relmap-admin migrate` brings it over" : "; it is of a newer release"));
  if (read_only) return Status(Reason::NO_SUCH_FILE, directory + " holds no map");
  if (Status free = check_folder(directory); !free.ok()) return free;
  return write_format(directory, format);
}

Status write_format(const std::string& directory, int format) {
  const auto files = posix_file_system();
  const std::string path = directory + "/FORMAT";
  const std::string draft = path + ".new";
  std::remove(draft.c_str());
  auto file = files->open_append(draft);
  if (!file.ok()) return file.status();
  const std::string text = std::string(kProduct) + " " + std::to_string(format) + "\n";
  if (Status status = (*file)->append(as_bytes(text)); !status.ok()) return status;
  if (Status status = (*file)->sync(); !status.ok()) return status;
  if (std::rename(draft.c_str(), path.c_str()) != 0) return failed(path);
  return files->sync_directory(directory);
}

}  // namespace relmap::storage
