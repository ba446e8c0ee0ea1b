#include "tools/bench/allocation_counter.h"

#include <dlfcn.h>

#include <cerrno>
#include <cstddef>
#include <new>

namespace {

thread_local std::uint64_t count = 0;

}  // namespace

namespace relmap::bench {

std::uint64_t allocations() { return count; }

}  // namespace relmap::bench

// The sanitizers have a malloc() of their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace {

// The real allocator, which is called by this one.
template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

void* malloc(std::size_t size) {
  static auto* const allocate = next<void*(std::size_t)>("malloc");
  ++count;
  return allocate(size);
}
void* calloc(std::size_t items, std::size_t size) {
  static auto* const allocate = next<void*(std::size_t, std::size_t)>("calloc");
  ++count;
  return allocate(items, size);
}
void* realloc(void* old, std::size_t size) {
  static auto* const allocate = next<void*(void*, std::size_t)>("realloc");
  ++count;
  return allocate(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  static auto* const allocate = next<void*(std::size_t, std::size_t)>("memalign");
  ++count;
  return allocate(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** result, std::size_t alignment, std::size_t size) {
  *result = memalign(alignment, size);
  return *result ? 0 : ENOMEM;
}

}  // extern "C"

// jemalloc has its own, which go past malloc().
void* operator new(std::size_t size) {
  if (void* made = malloc(size)) return made;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return malloc(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return malloc(size); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  if (void* made = memalign(static_cast<std::size_t>(alignment), size)) return made;
  throw std::bad_alloc();
}

#endif
