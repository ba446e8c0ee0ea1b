#include "tests/camera/under_mock.h"

#include <dlfcn.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace relmap::testing {

namespace {

// The library of a sanitizer that this program is built with; it wants to be the first of all.
std::string sanitizer_library() {
  for (const char* function : {"__asan_init", "__tsan_init"}) {
    Dl_info where;
    void* const address = ::dlsym(RTLD_DEFAULT, function);
    if (address && ::dladdr(address, &where) != 0 && std::strstr(where.dli_fname, ".so")) return where.dli_fname;
  }
  return {};
}

}  // namespace

void start_under_mock(char** arguments) {
  constexpr const char* kLibrary = "libumockdev-preload.so.0";
  const char* const present = std::getenv("LD_PRELOAD");
  if (present && std::strstr(present, kLibrary)) return;
  std::string libraries = sanitizer_library();
  if (!libraries.empty()) libraries += ':';
  libraries += kLibrary;
  if (present && *present) libraries += std::string(":") + present;
  ::setenv("LD_PRELOAD", libraries.c_str(), 1);
  ::execv("/proc/self/exe", arguments);
  std::perror("start_under_mock");
  std::exit(127);
}

}  // namespace relmap::testing
