#include "server/ops/process.h"

#include <fstream>
#include <string>

namespace relmap {

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

}  // namespace relmap
