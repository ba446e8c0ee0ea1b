#include "server/monitor/last_words.h"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>

namespace relmap::monitor {

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

std::atomic<LastWords> form = LastWords::kText;

void write_all(const char* text, std::size_t size) { (void)!::write(STDERR_FILENO, text, size); }
void write_all(const char* text) { write_all(text, std::strlen(text)); }

// What could break the line or, in JSON, the text.
bool is_special(char c) { return static_cast<unsigned char>(c) < ' ' || c == '"' || c == '\\'; }

void write_on_one_line(const char* text) {
  while (*text != 0) {
    std::size_t plain = 0;
    while (text[plain] != 0 && !is_special(text[plain])) ++plain;
    write_all(text, plain);
    text += plain;
    if (*text == 0) return;
    write_all("'");
    ++text;
  }
}

// There may be no memory for a log.
void say(const char* reason, const char* why) {
  switch (form) {
    case LastWords::kText:
      write_all("[relmapd] [critical] ");
      break;
    case LastWords::kJournal:
      write_all("<2>");
      break;
    case LastWords::kJson:
      write_all(R"({"level":"critical","message":")");
  }
  write_all(reason);
  write_all(": ");
  write_on_one_line(why);
  write_all(form == LastWords::kJson ? "\"}\n" : "\n");
}

[[noreturn]] void end_without_memory() {
  say("BUDGET_EXCEEDED", "out of memory; nothing acknowledged is lost, the next start applies the rest");
  ::_exit(EXIT_FAILURE);
}

[[noreturn]] void end() {
  try {
    if (memory_ran_out && std::uncaught_exceptions() > 0) end_without_memory();
    if (std::current_exception()) throw;
    say("INTERNAL", "terminated");
  } catch (const std::bad_alloc&) {
    end_without_memory();
  } catch (const std::exception& error) {
    say("INTERNAL", error.what());
  } catch (...) {
    say("INTERNAL", "an unknown exception");
  }
  std::abort();
}

// For what is made before main().
[[gnu::constructor(101)]] void before_all_else() { name_reason_of_sudden_end(); }

}  // namespace

void say_last_words_as(LastWords words) { form = words; }

void name_reason_of_sudden_end() {
  std::set_new_handler(no_memory);
  std::set_terminate(end);
}

}  // namespace relmap::monitor
