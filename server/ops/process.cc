#include "server/ops/process.h"

#include <sys/resource.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

// Of jemalloc; null if the program does not link it.
extern "C" int mallctl(const char* name, void* old, std::size_t* old_size, void* fresh, std::size_t fresh_size)
    __attribute__((weak));

namespace relmap::ops {

namespace {

// A field of /proc/self/status, given there in kB.
std::size_t status_field(const char* field) {
  std::ifstream status("/proc/self/status");
  std::string name;
  std::size_t kilobytes = 0;
  while (status >> name) {
    if (name == field && status >> kilobytes) return kilobytes * 1024;
    status.ignore(4096, '\n');
  }
  return 0;
}

}  // namespace

std::size_t raise_file_limit() {
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0) return 0;
  files.rlim_cur = files.rlim_max;
  if (setrlimit(RLIMIT_NOFILE, &files) != 0) getrlimit(RLIMIT_NOFILE, &files);
  return files.rlim_cur;
}

std::size_t resident_bytes() { return status_field("VmRSS:"); }
std::size_t peak_resident_bytes() { return status_field("VmHWM:"); }

double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::size_t open_files() {
  std::error_code error;
  std::filesystem::directory_iterator files("/proc/self/fd", error);
  return error ? 0 : static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

std::size_t max_files() {
  rlimit files{};
  return getrlimit(RLIMIT_NOFILE, &files) == 0 ? files.rlim_cur : 0;
}

std::size_t allocator_holes_bytes() {
  if (!mallctl) return 0;
  std::uint64_t epoch = 1;  // any value: it makes the statistics those of now
  if (mallctl("epoch", nullptr, nullptr, &epoch, sizeof epoch) != 0) return 0;
  const auto read = [](const char* name) {
    std::size_t bytes = 0, size = sizeof bytes;
    return mallctl(name, &bytes, &size, nullptr, 0) == 0 ? bytes : 0;
  };
  const std::size_t in_use = read("stats.allocated");
  return std::max(read("stats.active"), in_use) - in_use;
}

void give_back_free_memory() {
  if (mallctl) (void)mallctl("arena.4096.decay", nullptr, nullptr, nullptr, 0);  // 4096: all arenas
}

}  // namespace relmap::ops
