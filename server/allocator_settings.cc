// How jemalloc is set up in a program that links it (docs/decisions/paging.md): two arenas for all threads, and freed
// pages back to the system soon, those of a megabyte or more at once, so that the process stays near what it holds.
extern "C" {
extern const char* malloc_conf;
const char* malloc_conf = "narenas:2,dirty_decay_ms:50,muzzy_decay_ms:0,tcache_max:4096,oversize_threshold:1048576";
}
