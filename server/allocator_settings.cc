// Settings of jemalloc for programs that link it (docs/decisions/paging.md): two arenas for all threads; freed pages go
// back to the system soon, and those of a megabyte or more at once, so that the process stays near what it uses.
extern "C" {
extern const char* malloc_conf;
const char* malloc_conf = "narenas:2,dirty_decay_ms:50,muzzy_decay_ms:0,tcache_max:4096,oversize_threshold:1048576";
}
