#include "tests/camera/under_mock.h"

#include <dlfcn.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace relmap::testing {

namespace {

// Where a sanitizer that this program is built with has its functions.
std::string sanitizer_file() {
  for (const char* function : {"__asan_init", "__tsan_init"}) {
    Dl_info where;
    void* const address = ::dlsym(RTLD_DEFAULT, function);
    if (address && ::dladdr(address, &where) != 0) return where.dli_fname;
  }
  return {};
}

// It wants to be the first of all, where it is a library.
std::string sanitizer_library() {
  const std::string file = sanitizer_file();
  return file.find(".so") != std::string::npos ? file : std::string();
}

}  // namespace

void start_under_mock(char** arguments) {
  constexpr const char* kLibrary = "libumockdev-preload.so.0";
  const char* const present = std::getenv("LD_PRELOAD");
  if (present && std::strstr(present, kLibrary)) return;
  std::string libraries = sanitizer_library();
  if (!libraries.empty()) libraries += ':';
  libraries += kLibrary;
  // GLib and libumockdev are built without it and lock in ways that ThreadSanitizer does not see: what they do to their
  // own memory is not for it to judge.
  if (libraries.find("tsan") != std::string::npos) {
    const char* const options = std::getenv("TSAN_OPTIONS");
    ::setenv("TSAN_OPTIONS", (std::string(options ? options : "") + ":ignore_noninstrumented_modules=1").c_str(), 1);
  }
  if (present && *present) libraries += std::string(":") + present;
  ::setenv("LD_PRELOAD", libraries.c_str(), 1);
  ::execv("/proc/self/exe", arguments);
  std::perror("start_under_mock");
  std::exit(127);
}

bool built_with_sanitizer() { return !sanitizer_file().empty(); }

}  // namespace relmap::testing
