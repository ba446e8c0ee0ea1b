#include "server/ops/last_words.h"

#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>

namespace relmap::ops {

namespace {

// There may be no memory for a log.
void say(const char* text) { (void)!::write(STDERR_FILENO, text, std::strlen(text)); }

[[noreturn]] void end() {
  try {
    if (std::current_exception()) throw;
    say("[relmapd] [critical] INTERNAL: terminated\n");
  } catch (const std::bad_alloc&) {
    say("[relmapd] [critical] BUDGET_EXCEEDED: out of memory; nothing acknowledged is lost, the next start applies the "
        "rest\n");
    ::_exit(EXIT_FAILURE);
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
[[gnu::constructor(101)]] void before_all_else() { std::set_terminate(end); }

}  // namespace

void name_reason_of_sudden_end() { std::set_terminate(end); }

}  // namespace relmap::ops
