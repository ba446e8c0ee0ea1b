#include "server/ops/process.h"

#include <fstream>
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

std::size_t resident_bytes() { return status_field("VmRSS:"); }
std::size_t peak_resident_bytes() { return status_field("VmHWM:"); }

void give_back_free_memory() {
  if (mallctl) (void)mallctl("arena.4096.decay", nullptr, nullptr, nullptr, 0);  // 4096: all arenas
}

}  // namespace relmap::ops
