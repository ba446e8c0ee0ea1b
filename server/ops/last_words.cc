#include "server/ops/last_words.h"

#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>

namespace relmap::ops {

namespace {

// Whether an exception of this thread was one of these. Where std::terminate() is called while an exception passes a
// destructor (a library's thread that nobody has joined), nothing tells which exception that is; in a thread that has
// run out of memory before, it is taken for the same again.
thread_local bool memory_ran_out = false;

// Called by operator new where it has found no memory.
void no_memory() {
  memory_ran_out = true;
  throw std::bad_alloc();
}

// There may be no memory for a log.
void say(const char* text) { (void)!::write(STDERR_FILENO, text, std::strlen(text)); }

[[noreturn]] void end_without_memory() {
  say("[relmapd] [critical] BUDGET_EXCEEDED: out of memory; nothing acknowledged is lost, the next start applies the "
      "rest\n");
  ::_exit(EXIT_FAILURE);
}

[[noreturn]] void end() {
  try {
    if (memory_ran_out && std::uncaught_exceptions() > 0) end_without_memory();
    if (std::current_exception()) throw;
    say("[relmapd] [critical] INTERNAL: terminated\n");
  } catch (const std::bad_alloc&) {
    end_without_memory();
  } catch (const std::exception& error) {
    say("[relmapd] [critical] INTERNAL: ");
    say(error.what());
    say("\n");
  } catch (...) {
    say("[relmapd] [critical] INTERNAL: an unknown exception\n");
  }
  std::abort();
}

// For what is made before main().
[[gnu::constructor(101)]] void before_all_else() { name_reason_of_sudden_end(); }

}  // namespace

void name_reason_of_sudden_end() {
  std::set_new_handler(no_memory);
  std::set_terminate(end);
}

}  // namespace relmap::ops
