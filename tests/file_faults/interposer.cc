// Put under a program with LD_PRELOAD: records what the program does to the files below a folder, or makes the n-th
// operation fail or hang (control.h). Whatever writes by other ways than those here is not seen: streams of the C
// library (RocksDB's own log, which nobody reads) are recorded as empty files, and what this library knows of and
// cannot record (writable shared maps, symbolic links, direct system calls) ends the program. Only files and folders
// are recorded, not sockets.
#include <dirent.h>
#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <link.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstring>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "tests/file_faults/control.h"

namespace {

using namespace relmap::testing;

// The function that this library stands before.
template <typename Function>
Function* next(const char* name, Function* /*as*/) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}
#define NEXT(name)                                              \
  ([]() {                                                       \
    static decltype(&::name) const found = next(#name, ::name); \
    return found;                                               \
  }())

constexpr int kDescriptors = 1 << 16;
constexpr std::uint32_t kNap_ms = 10;
bool watched[kDescriptors];  // descriptors of files below the root
std::string* root = nullptr;
FaultControl* control = nullptr;
int trace = -1;
std::atomic<int> full{-1};  // a descriptor whose next write finds no room
pthread_mutex_t mutex = PTHREAD_RECURSIVE_MUTEX_INITIALIZER_NP;
std::uintptr_t program_begin = 0, program_end = 0;

// While operations are recorded they happen one at a time, in the order of the record.
class InOrder {
 public:
  InOrder() : locked_(trace >= 0) {
    if (locked_) ::pthread_mutex_lock(&mutex);
  }
  ~InOrder() {
    const int error = errno;
    if (locked_) ::pthread_mutex_unlock(&mutex);
    errno = error;
  }
  InOrder(const InOrder&) = delete;
  InOrder& operator=(const InOrder&) = delete;

 private:
  const bool locked_;
};

[[noreturn]] void give_up(const char* why) {
  const std::string line = std::string("file faults: ") + why + "\n";
  (void)!NEXT(write)(STDERR_FILENO, line.data(), line.size());
  ::_exit(99);
}

bool is_watched(int fd) { return root != nullptr && fd >= 0 && fd < kDescriptors && watched[fd]; }

void watch(int fd, bool on) {
  if (fd >= kDescriptors) give_up("more descriptors than can be watched");
  if (fd >= 0) watched[fd] = on;
}

void record(TraceHeader header, const std::string& path = {}, const std::string& other = {},
            const std::string& bytes = {}) {
  if (trace < 0) return;
  const int error = errno;
  header.path = static_cast<std::uint32_t>(path.size());
  header.other = static_cast<std::uint32_t>(other.size());
  header.bytes = bytes.size();
  std::string all(reinterpret_cast<const char*>(&header), sizeof header);
  all += path + other + bytes;
  for (std::size_t done = 0; done < all.size();) {
    const ssize_t n = NEXT(write)(trace, all.data() + done, all.size() - done);
    if (n <= 0) give_up("the trace cannot be written");
    done += static_cast<std::size_t>(n);
  }
  ++control->recorded;
  errno = error;
}

// Whether the operation that comes now fails; then errno says why.
bool faulty(FaultKind kind) {
  if (control == nullptr) return false;
  const auto at = static_cast<std::size_t>(kind);
  const std::uint64_t n = ++control->counts[at];
  const std::uint64_t failing = control->failing[at];
  if (failing == 0 || n < failing || (n > failing && control->lasting == 0)) return false;
  ++control->hits;
  if (const std::uint32_t ms = control->hang_ms; ms > 0) {
    ++control->hanging;
    // In short pieces, so that it goes on when the disk is mended.
    for (std::uint32_t slept = 0; slept < ms && control->failing[at] != 0; slept += kNap_ms) {
      const timespec nap{0, kNap_ms * 1000000L};
      ::nanosleep(&nap, nullptr);
    }
    --control->hanging;
  }
  if (control->error == 0) return false;
  errno = control->error;
  return true;
}

std::string link_target(const std::string& link) {
  char target[PATH_MAX];
  const ssize_t n = ::readlink(link.c_str(), target, sizeof target);
  return n < 0 ? std::string() : std::string(target, static_cast<std::size_t>(n));
}

// The path relative to the root; "/" for what does not lie below it. The last part is followed if `follow`.
const std::string kElsewhere = "/";
std::string below_root(int folder, const char* given, bool follow) {
  if (root == nullptr || given == nullptr) return kElsewhere;
  const int error = errno;
  std::string path = given;
  if (path.empty()) return kElsewhere;
  if (path.front() == '/') {
    // The same folder may be given by another name, so that the start of the name tells nothing but here.
    const bool descriptor = path.compare(0, 13, "/proc/self/fd") == 0;
    if (!descriptor && (path.compare(0, 6, "/proc/") == 0 || path.compare(0, 5, "/sys/") == 0)) return kElsewhere;
  } else {
    path =
        (folder == AT_FDCWD ? link_target("/proc/self/cwd") : link_target("/proc/self/fd/" + std::to_string(folder))) +
        "/" + path;
  }
  while (path.size() > 1 && path.back() == '/') path.pop_back();
  std::size_t slash = path.rfind('/');
  std::string name = path.substr(slash + 1);
  char real[PATH_MAX];
  struct stat facts {};
  const bool whole = name == "." || name == ".." || path.compare(0, 14, "/proc/self/fd/") == 0
                         ? path.find('/', 14) == std::string::npos || name == "." || name == ".."
                         : follow && ::lstat(path.c_str(), &facts) == 0 && S_ISLNK(facts.st_mode);
  std::string found;
  if (whole) {
    if (::realpath(path.c_str(), real) != nullptr) found = real;
  } else if (::realpath(slash == 0 ? "/" : path.substr(0, slash).c_str(), real) != nullptr) {
    found = std::string(real) + "/" + name;
  }
  errno = error;
  if (found == *root) return "";
  if (found.compare(0, root->size() + 1, *root + "/") != 0) return kElsewhere;
  return found.substr(root->size() + 1);
}

// What a name stands for: files and folders are recorded.
enum class Named { kNothing, kRecorded, kOther };
Named what_is(int folder, const char* path) {
  struct stat facts {};
  const int error = errno;
  const bool known = ::fstatat(folder, path, &facts, AT_SYMLINK_NOFOLLOW) == 0;
  errno = error;
  if (!known) return Named::kNothing;
  return S_ISREG(facts.st_mode) || S_ISDIR(facts.st_mode) ? Named::kRecorded : Named::kOther;
}

bool in_program(const void* address) {
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  return at >= program_begin && at < program_end;
}

// Whether the address, which must be in the program, is in a template of the standard library. Looked up once each.
bool in_template(const void* address) {
  constexpr std::size_t kKnown = 1 << 16;
  static std::atomic<std::uintptr_t> known[kKnown];  // the address, doubled, and the answer
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  std::atomic<std::uintptr_t>& slot = known[at % kKnown];
  if (const std::uintptr_t found = slot.load(std::memory_order_relaxed); found >> 1 == at) return (found & 1) != 0;
  Dl_info info{};
  const bool shared = ::dladdr(static_cast<const char*>(address) - 1, &info) != 0 && info.dli_sname != nullptr;
  const std::string_view name = shared ? info.dli_sname : "";
  const bool answer = name.starts_with("_ZNSt") || name.starts_with("_ZNKSt") || name.starts_with("_ZSt");
  slot.store(at << 1 | (answer ? 1 : 0), std::memory_order_relaxed);
  return answer;
}

// Whether the program itself asks, and not a library: which may do so by a template of the standard library that the
// linker has taken from the program.
bool program_asks(const void* caller) {
  if (!in_program(caller)) return false;
  if (!in_template(caller)) return true;
  static thread_local bool asked = false;
  if (asked) return false;
  asked = true;
  void* frames[16];
  const int count = ::backtrace(frames, 16);
  int at = 0;
  while (at < count && frames[at] != caller) ++at;
  while (at < count && in_program(frames[at]) && in_template(frames[at])) ++at;
  asked = false;
  return at < count && in_program(frames[at]);
}

__attribute__((constructor)) void begin() {
  const char* const folder = ::getenv(kFaultRoot);
  const char* const shared = ::getenv(kFaultControl);
  if (folder == nullptr || shared == nullptr) return;
  const int fd = NEXT(open)(shared, O_RDWR | O_CLOEXEC);
  void* const mapped =
      fd < 0 ? MAP_FAILED : NEXT(mmap)(nullptr, sizeof(FaultControl), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  if (mapped == MAP_FAILED) give_up("the control file cannot be used");
  NEXT(close)(fd);
  if (const char* const to = ::getenv(kFaultTrace)) {
    trace = NEXT(open)(to, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
    if (trace < 0) give_up("the trace cannot be opened");
  }
  ::dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void*) {  // the program comes first
        for (int i = 0; i < info->dlpi_phnum; ++i)
          if (const auto& part = info->dlpi_phdr[i]; part.p_type == PT_LOAD && (part.p_flags & PF_X) != 0) {
            program_begin = info->dlpi_addr + part.p_vaddr;
            program_end = program_begin + part.p_memsz;
          }
        return 1;
      },
      nullptr);
  void* frames[4];
  (void)::backtrace(frames, 4);  // the first call loads a library
  control = static_cast<FaultControl*>(mapped);
  root = new std::string(folder);
}

int opened(int folder, const char* path, int flags, mode_t mode) {
  const InOrder order;
  const std::string below = below_root(folder, path, (flags & O_NOFOLLOW) == 0);
  if (below != kElsewhere && (flags & O_TMPFILE) == O_TMPFILE) give_up("a file without a name");
  if (below != kElsewhere && faulty(FaultKind::kOpen)) return -1;
  const int fd = NEXT(openat)(folder, path, flags, mode);
  if (fd >= 0 && root != nullptr) {
    watch(fd, below != kElsewhere);
    if (below != kElsewhere) record({OperationKind::kOpen, fd, flags}, below);
  }
  return fd;
}

FILE* opened_stream(FILE* (*open_it)(const char*, const char*), const char* path, const char* mode) {
  const InOrder order;
  const std::string below = below_root(AT_FDCWD, path, true);
  if (below != kElsewhere && faulty(FaultKind::kOpen)) return nullptr;
  FILE* const stream = open_it(path, mode);
  if (stream != nullptr && root != nullptr) {
    const int fd = ::fileno(stream);
    watch(fd, below != kElsewhere);
    const int flags = mode[0] == 'w' ? O_WRONLY | O_CREAT | O_TRUNC : mode[0] == 'a' ? O_WRONLY | O_CREAT : O_RDONLY;
    if (below != kElsewhere) record({OperationKind::kOpen, fd, flags}, below);
  }
  return stream;
}

void written(int fd, std::int64_t offset, const void* data, ssize_t n) {
  if (n <= 0 || trace < 0) return;
  TraceHeader header{OperationKind::kWrite, fd};
  header.offset = static_cast<std::uint64_t>(offset >= 0 ? offset : ::lseek(fd, 0, SEEK_CUR) - n);
  record(header, {}, {}, std::string(static_cast<const char*>(data), static_cast<std::size_t>(n)));
}

std::string joined(const iovec* parts, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all.append(static_cast<const char*>(parts[i].iov_base), parts[i].iov_len);
  return all;
}

// What the system wrote by itself is read back.
void copied(int fd, std::int64_t offset, ssize_t n) {
  if (n <= 0 || trace < 0) return;
  std::string bytes(static_cast<std::size_t>(n), '\0');
  const std::string own = "/proc/self/fd/" + std::to_string(fd);
  const int reading = NEXT(open)(own.c_str(), O_RDONLY | O_CLOEXEC);
  if (reading < 0 || ::pread(reading, bytes.data(), bytes.size(), offset) != n) give_up("a copy cannot be read back");
  NEXT(close)(reading);
  written(fd, offset, bytes.data(), n);
}

int resized(int result, int fd, OperationKind kind, std::uint64_t size) {
  TraceHeader header{kind, fd};
  header.offset = size;
  if (result == 0) record(header);
  return result;
}

int renamed(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  const InOrder order;
  const std::string a = below_root(from_folder, from, false), b = below_root(to_folder, to, false);
  const Named moved = what_is(from_folder, from), replaced = what_is(to_folder, to);
  const int result = NEXT(renameat2)(from_folder, from, to_folder, to, flags);
  if (result == 0 && (a != kElsewhere) != (b != kElsewhere)) give_up("a rename across the root");
  if (result == 0 && a != kElsewhere && replaced != Named::kNothing && replaced != moved)
    give_up("a rename between what is recorded and what is not");
  if (result == 0 && a != kElsewhere && moved == Named::kRecorded)
    record({OperationKind::kRename, -1, static_cast<int>(flags)}, a, b);
  return result;
}

int linked(int from_folder, const char* from, int to_folder, const char* to, int flags) {
  const InOrder order;
  const std::string a = below_root(from_folder, from, false), b = below_root(to_folder, to, false);
  const int result = NEXT(linkat)(from_folder, from, to_folder, to, flags);
  if (result == 0 && b != kElsewhere && (a == kElsewhere || what_is(to_folder, to) != Named::kRecorded))
    give_up("a link to what is not recorded");
  if (result == 0 && b != kElsewhere) record({OperationKind::kLink}, a, b);
  return result;
}

template <typename Remove>
int removed(int folder, const char* path, const Remove& remove) {
  const InOrder order;
  const std::string below = below_root(folder, path, false);
  const bool recorded = below != kElsewhere && what_is(folder, path) == Named::kRecorded;
  const int result = remove();
  if (result == 0 && recorded) record({OperationKind::kRemove}, below);
  return result;
}

int made_folder(int folder, const char* path, mode_t mode) {
  const InOrder order;
  const std::string below = below_root(folder, path, false);
  const int result = NEXT(mkdirat)(folder, path, mode);
  if (result == 0 && below != kElsewhere) record({OperationKind::kMakeFolder}, below);
  return result;
}

template <typename Sync>
int synced(int fd, const Sync& sync) {
  if (!is_watched(fd)) return sync();
  const InOrder order;
  // Whoever acknowledges something before its sync has returned has time to do so.
  if (trace >= 0) ::usleep(5000);
  const int result = faulty(FaultKind::kSync) ? -1 : sync();
  record({result == 0 ? OperationKind::kSync : OperationKind::kFailedSync, fd});
  return result;
}

template <typename Close>
auto closed(int fd, const Close& close) {
  if (!is_watched(fd)) return close();
  const InOrder order;
  watch(fd, false);
  int closing = fd;
  full.compare_exchange_strong(closing, -1);
  record({OperationKind::kClose, fd});
  return close();
}

mode_t mode_of(int flags, va_list arguments) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? static_cast<mode_t>(va_arg(arguments, int)) : mode_t{0};
}
#define MODE_OF(flags)                           \
  va_list arguments;                             \
  va_start(arguments, flags);                    \
  const mode_t mode = mode_of(flags, arguments); \
  va_end(arguments)

// A write to a full disk stores what there is room for, and the next one to the file fails. So half is written, or
// copied, by `write`, which gets the number of bytes.
template <typename Write>
ssize_t faulty_write(int fd, std::size_t size, const Write& write) {
  if (int expected = fd; full.compare_exchange_strong(expected, -1)) {
    errno = ENOSPC;
    return -1;
  }
  if (!faulty(FaultKind::kWrite)) return write(size);
  if (errno != ENOSPC || size < 2 || control->lasting != 0) return -1;  // there is no room at all
  const ssize_t n = write(size / 2);
  if (n > 0) full = fd;
  return n;
}

template <typename Write>
ssize_t watched_write(int fd, std::int64_t offset, const void* data, std::size_t size, const Write& write) {
  if (!is_watched(fd)) return write(size);
  const InOrder order;
  if (offset >= 0 && trace >= 0 && (::fcntl(fd, F_GETFL) & O_APPEND) != 0)
    give_up("a write at an offset of a file that is appended to, which Linux appends");
  const ssize_t n = faulty_write(fd, size, write);
  written(fd, offset, data, n);
  return n;
}
// `gather` writes all parts, `write` the first bytes of what they hold.
template <typename Gather, typename Write>
ssize_t watched_gather(int fd, std::int64_t offset, const iovec* parts, int count, const Gather& gather,
                       const Write& write) {
  if (!is_watched(fd)) return gather();
  const std::string all = joined(parts, count);
  return watched_write(fd, offset, all.data(), all.size(),
                       [&](std::size_t size) { return size == all.size() ? gather() : write(all.data(), size); });
}

// A descriptor that stands for the same file as another.
int duplicated(int fd, int copy) {
  if (copy < 0 || copy == fd || root == nullptr) return copy;
  const bool closes = is_watched(copy);
  watch(copy, is_watched(fd));
  if (is_watched(fd))
    record({OperationKind::kDuplicate, fd, copy});
  else if (closes)
    record({OperationKind::kClose, copy});
  return copy;
}

template <typename Control>
int controlled(int fd, int command, const Control& control_it) {
  if (command != F_DUPFD && command != F_DUPFD_CLOEXEC) return control_it();
  const InOrder order;
  return duplicated(fd, control_it());
}

// System calls that would change files below the root unseen, by what they take first: a descriptor, a path, or the
// descriptor of a folder and a path.
bool writes_to_descriptor(long number) {
  switch (number) {
    case SYS_write:
    case SYS_pwrite64:
    case SYS_writev:
    case SYS_pwritev:
    case SYS_pwritev2:
    case SYS_ftruncate:
    case SYS_fallocate:
    case SYS_fsync:
    case SYS_fdatasync:
    case SYS_dup:
    case SYS_dup3:
    case SYS_close:
    case SYS_sendfile:
      return true;
    default:
      return false;
  }
}
bool writes_to_path(long number) {
  switch (number) {
    case SYS_truncate:
#ifdef SYS_open  // some architectures have only those that take a folder
    case SYS_open:
    case SYS_creat:
    case SYS_rename:
    case SYS_unlink:
    case SYS_rmdir:
    case SYS_mkdir:
    case SYS_link:
    case SYS_symlink:
#endif
      return true;
    default:
      return false;
  }
}
bool takes_two_paths(long number) {
#ifdef SYS_open
  return number == SYS_rename || number == SYS_link || number == SYS_symlink;
#else
  return number < 0;
#endif
}
bool writes_to_path_in_folder(long number) {
  switch (number) {
    case SYS_openat:
    case SYS_renameat:
    case SYS_linkat:
    case SYS_symlinkat:
    case SYS_unlinkat:
    case SYS_mkdirat:
      return true;
    default:
      return false;
  }
}

void* allocated(const void* caller) {
  if (control != nullptr && program_asks(caller) && faulty(FaultKind::kAllocation)) return nullptr;
  return const_cast<void*>(caller);  // anything but null
}
using New = void*(std::size_t);
using AlignedNew = void*(std::size_t, std::align_val_t);

}  // namespace

extern "C" {

// Declared here where the C library has inline versions of them.
int __open_2(const char* path, int flags);
int __open64_2(const char* path, int flags);
int __openat_2(int folder, const char* path, int flags);
int __openat64_2(int folder, const char* path, int flags);

int open(const char* path, int flags, ...) {
  MODE_OF(flags);
  return opened(AT_FDCWD, path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  MODE_OF(flags);
  return opened(AT_FDCWD, path, flags, mode);
}
int openat(int folder, const char* path, int flags, ...) {
  MODE_OF(flags);
  return opened(folder, path, flags, mode);
}
int openat64(int folder, const char* path, int flags, ...) {
  MODE_OF(flags);
  return opened(folder, path, flags, mode);
}
int __open_2(const char* path, int flags) { return opened(AT_FDCWD, path, flags, 0); }
int __open64_2(const char* path, int flags) { return opened(AT_FDCWD, path, flags, 0); }
int __openat_2(int folder, const char* path, int flags) { return opened(folder, path, flags, 0); }
int __openat64_2(int folder, const char* path, int flags) { return opened(folder, path, flags, 0); }
int creat(const char* path, mode_t mode) { return opened(AT_FDCWD, path, O_WRONLY | O_CREAT | O_TRUNC, mode); }
int creat64(const char* path, mode_t mode) { return opened(AT_FDCWD, path, O_WRONLY | O_CREAT | O_TRUNC, mode); }
FILE* fopen(const char* path, const char* mode) { return opened_stream(NEXT(fopen), path, mode); }
FILE* fopen64(const char* path, const char* mode) { return opened_stream(NEXT(fopen64), path, mode); }

ssize_t write(int fd, const void* data, size_t size) {
  return watched_write(fd, -1, data, size, [&](std::size_t n) { return NEXT(write)(fd, data, n); });
}
ssize_t pwrite(int fd, const void* data, size_t size, off_t offset) {
  return watched_write(fd, offset, data, size, [&](std::size_t n) { return NEXT(pwrite)(fd, data, n, offset); });
}
ssize_t pwrite64(int fd, const void* data, size_t size, off64_t offset) {
  return watched_write(fd, offset, data, size, [&](std::size_t n) { return NEXT(pwrite64)(fd, data, n, offset); });
}
ssize_t writev(int fd, const iovec* parts, int count) {
  return watched_gather(
      fd, -1, parts, count, [&] { return NEXT(writev)(fd, parts, count); },
      [&](const char* data, std::size_t n) { return NEXT(write)(fd, data, n); });
}
ssize_t pwritev(int fd, const iovec* parts, int count, off_t offset) {
  return watched_gather(
      fd, offset, parts, count, [&] { return NEXT(pwritev)(fd, parts, count, offset); },
      [&](const char* data, std::size_t n) { return NEXT(pwrite)(fd, data, n, offset); });
}
ssize_t pwritev64(int fd, const iovec* parts, int count, off64_t offset) { return pwritev(fd, parts, count, offset); }
ssize_t copy_file_range(int in, off64_t* in_offset, int out, off64_t* out_offset, size_t size, unsigned flags) {
  if (!is_watched(out)) return NEXT(copy_file_range)(in, in_offset, out, out_offset, size, flags);
  const InOrder order;
  const ssize_t n = faulty_write(out, size, [&](std::size_t bytes) {
    return NEXT(copy_file_range)(in, in_offset, out, out_offset, bytes, flags);
  });
  copied(out, (out_offset != nullptr ? *out_offset : ::lseek(out, 0, SEEK_CUR)) - n, n);
  return n;
}
ssize_t sendfile(int out, int in, off_t* offset, size_t size) {
  if (!is_watched(out)) return NEXT(sendfile)(out, in, offset, size);
  const InOrder order;
  const ssize_t n = faulty_write(out, size, [&](std::size_t bytes) { return NEXT(sendfile)(out, in, offset, bytes); });
  copied(out, ::lseek(out, 0, SEEK_CUR) - n, n);
  return n;
}
ssize_t sendfile64(int out, int in, off64_t* offset, size_t size) { return sendfile(out, in, offset, size); }

int ftruncate(int fd, off_t size) {
  if (!is_watched(fd)) return NEXT(ftruncate)(fd, size);
  const InOrder order;
  return resized(NEXT(ftruncate)(fd, size), fd, OperationKind::kResize, static_cast<std::uint64_t>(size));
}
int ftruncate64(int fd, off64_t size) { return ftruncate(fd, size); }
int truncate(const char* path, off_t size) {
  const InOrder order;
  const std::string below = below_root(AT_FDCWD, path, true);
  const int result = NEXT(truncate)(path, size);
  TraceHeader header{OperationKind::kResizeAt};
  header.offset = static_cast<std::uint64_t>(size);
  if (result == 0 && below != kElsewhere) record(header, below);
  return result;
}
int truncate64(const char* path, off64_t size) { return truncate(path, size); }
int fallocate(int fd, int mode, off_t offset, off_t size) {
  if (!is_watched(fd)) return NEXT(fallocate)(fd, mode, offset, size);
  const InOrder order;
  struct stat before {};
  if (::fstat(fd, &before) != 0) give_up("a file cannot be looked at");
  const int result = NEXT(fallocate)(fd, mode, offset, size);
  if (result == 0 && (mode & ~FALLOC_FL_KEEP_SIZE) != 0 && (mode & FALLOC_FL_PUNCH_HOLE) == 0)
    give_up("a kind of fallocate that is not known");
  // RocksDB punches holes only into what lies behind the end of a file.
  if (result == 0 && (mode & FALLOC_FL_PUNCH_HOLE) != 0 && offset < before.st_size) give_up("a hole within a file");
  if ((mode & FALLOC_FL_KEEP_SIZE) != 0) return result;
  return resized(result, fd, OperationKind::kExtend, static_cast<std::uint64_t>(offset + size));
}
int fallocate64(int fd, int mode, off64_t offset, off64_t size) { return fallocate(fd, mode, offset, size); }
int posix_fallocate(int fd, off_t offset, off_t size) {
  if (!is_watched(fd)) return NEXT(posix_fallocate)(fd, offset, size);
  const InOrder order;
  return resized(NEXT(posix_fallocate)(fd, offset, size), fd, OperationKind::kExtend,
                 static_cast<std::uint64_t>(offset + size));
}
int posix_fallocate64(int fd, off64_t offset, off64_t size) { return posix_fallocate(fd, offset, size); }

// What std::chrono and the program itself ask for the time of day.
int clock_gettime(clockid_t clock, timespec* time) {
  const int failed = NEXT(clock_gettime)(clock, time);
  if (failed == 0 && clock == CLOCK_REALTIME && control) time->tv_sec += control->clock_step_s;
  return failed;
}

int fsync(int fd) {
  return synced(fd, [&] { return NEXT(fsync)(fd); });
}
int fdatasync(int fd) {
  return synced(fd, [&] { return NEXT(fdatasync)(fd); });
}

int rename(const char* from, const char* to) { return renamed(AT_FDCWD, from, AT_FDCWD, to, 0); }
int renameat(int from_folder, const char* from, int to_folder, const char* to) {
  return renamed(from_folder, from, to_folder, to, 0);
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  return renamed(from_folder, from, to_folder, to, flags);
}
int link(const char* from, const char* to) { return linked(AT_FDCWD, from, AT_FDCWD, to, 0); }
int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) {
  return linked(from_folder, from, to_folder, to, flags);
}
int unlink(const char* path) {
  return removed(AT_FDCWD, path, [&] { return NEXT(unlink)(path); });
}
int unlinkat(int folder, const char* path, int flags) {
  return removed(folder, path, [&] { return NEXT(unlinkat)(folder, path, flags); });
}
int remove(const char* path) {
  return removed(AT_FDCWD, path, [&] { return NEXT(remove)(path); });
}
int rmdir(const char* path) {
  return removed(AT_FDCWD, path, [&] { return NEXT(rmdir)(path); });
}
int mkdir(const char* path, mode_t mode) { return made_folder(AT_FDCWD, path, mode); }
int mkdirat(int folder, const char* path, mode_t mode) { return made_folder(folder, path, mode); }

int close(int fd) {
  return closed(fd, [&] { return NEXT(close)(fd); });
}
int fclose(FILE* stream) {
  return closed(::fileno(stream), [&] { return NEXT(fclose)(stream); });
}
int closedir(DIR* folder) {
  return closed(::dirfd(folder), [&] { return NEXT(closedir)(folder); });
}
int dup(int fd) {
  const InOrder order;
  return duplicated(fd, NEXT(dup)(fd));
}
int dup2(int fd, int copy) {
  const InOrder order;
  return duplicated(fd, NEXT(dup2)(fd, copy));
}
int dup3(int fd, int copy, int flags) {
  const InOrder order;
  return duplicated(fd, NEXT(dup3)(fd, copy, flags));
}
int fcntl(int fd, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  return controlled(fd, command, [&] { return NEXT(fcntl)(fd, command, argument); });
}
int fcntl64(int fd, int command, ...) {
  va_list arguments;
  va_start(arguments, command);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  return controlled(fd, command, [&] { return NEXT(fcntl64)(fd, command, argument); });
}

int symlinkat(const char* target, int folder, const char* path) {
  if (below_root(folder, path, false) != kElsewhere) give_up("a symbolic link");
  return NEXT(symlinkat)(target, folder, path);
}
int symlink(const char* target, const char* path) { return symlinkat(target, AT_FDCWD, path); }

void* mmap(void* address, size_t size, int protection, int flags, int fd, off_t offset) {
  if (is_watched(fd) && (flags & MAP_SHARED) != 0 && (protection & PROT_WRITE) != 0)
    give_up("a writable shared map, whose writes cannot be seen");
  return NEXT(mmap)(address, size, protection, flags, fd, offset);
}
void* mmap64(void* address, size_t size, int protection, int flags, int fd, off64_t offset) {
  return mmap(address, size, protection, flags, fd, offset);
}

long syscall(long number, ...) {
  va_list arguments;
  va_start(arguments, number);
  long a[6];
  for (long& one : a) one = va_arg(arguments, long);
  va_end(arguments);
  const auto text = [](long at) { return reinterpret_cast<const char*>(at); };
  if (root != nullptr && number == SYS_renameat2)
    return renamed(static_cast<int>(a[0]), text(a[1]), static_cast<int>(a[2]), text(a[3]), static_cast<unsigned>(a[4]));
  if (root != nullptr && number == SYS_openat2) {
    const InOrder order;
    std::uint64_t flags = 0;
    std::memcpy(&flags, text(a[2]), sizeof flags);
    const std::string below = below_root(static_cast<int>(a[0]), text(a[1]), (flags & O_NOFOLLOW) == 0);
    if (below != kElsewhere && faulty(FaultKind::kOpen)) return -1;
    const long fd = NEXT(syscall)(number, a[0], a[1], a[2], a[3]);
    if (fd >= 0) watch(static_cast<int>(fd), below != kElsewhere);
    if (fd >= 0 && below != kElsewhere)
      record({OperationKind::kOpen, static_cast<int>(fd), static_cast<int>(flags)}, below);
    return fd;
  }
  const int first = static_cast<int>(a[0]);
  if ((writes_to_descriptor(number) && is_watched(first)) ||
      (number == SYS_copy_file_range && is_watched(static_cast<int>(a[2]))) ||
      (writes_to_path(number) && (below_root(AT_FDCWD, text(a[0]), true) != kElsewhere ||
                                  (takes_two_paths(number) && below_root(AT_FDCWD, text(a[1]), true) != kElsewhere))) ||
      (writes_to_path_in_folder(number) &&
       below_root(first, text(number == SYS_symlinkat ? a[2] : a[1]), true) != kElsewhere))
    give_up("a direct system call");
  return NEXT(syscall)(number, a[0], a[1], a[2], a[3], a[4], a[5]);
}

}  // extern "C"

// Memory that the program itself asks for. Where it fails, the program's own handler is called, as by the library; what
// a handler may have made free is not tried.
[[noreturn]] static void fail_to_allocate() {
  if (const std::new_handler handler = std::get_new_handler()) handler();
  throw std::bad_alloc();
}
#define ALLOCATE(TYPE, SYMBOL, ...)                                               \
  static TYPE* const found = reinterpret_cast<TYPE*>(::dlsym(RTLD_NEXT, SYMBOL)); \
  return found(__VA_ARGS__)

void* operator new(std::size_t size) {
  if (allocated(__builtin_return_address(0)) == nullptr) fail_to_allocate();
  ALLOCATE(New, "_Znwm", size);
}
void* operator new[](std::size_t size) {
  if (allocated(__builtin_return_address(0)) == nullptr) fail_to_allocate();
  ALLOCATE(New, "_Znam", size);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  if (allocated(__builtin_return_address(0)) == nullptr) fail_to_allocate();
  ALLOCATE(AlignedNew, "_ZnwmSt11align_val_t", size, alignment);
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  if (allocated(__builtin_return_address(0)) == nullptr) fail_to_allocate();
  ALLOCATE(AlignedNew, "_ZnamSt11align_val_t", size, alignment);
}
