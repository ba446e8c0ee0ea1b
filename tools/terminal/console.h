// Output of the command lines: data on stdout, everything else on stderr; and questions to the user at a terminal.
//
// Tables, facts, questions and reports show whatever text they are given as visible_text() does, since names, labels
// and notes come from elsewhere. What is written to out() and err() directly is written as it is.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

#include "proto/base/number_text.h"
#include "proto/base/status.h"
#include "proto/base/time_text.h"
#include "proto/geometry/geometry.h"

namespace relmap::terminal {

class Console {
 public:
  Console(std::ostream& out, std::ostream& err) : out_(out), err_(err) {}

  // Print answers as JSON, one document a line, instead of tables.
  bool json = false;
  // The command is done, but its result cannot be trusted; the exit code will say so.
  bool untrusted = false;
  // The command is done, but the daemon refused part of it for good; the exit code will say so.
  bool incomplete = false;
  // A document that was printed tells already what failed.
  bool outcome_told = false;

  std::ostream& out() { return out_; }
  std::ostream& err() { return err_; }

  // While an Aside lives, replies to the client are not part of the answer: reply() prints nothing.
  class Aside {
   public:
    explicit Aside(Console& console) : console_(console), was_(console.aside_) { console.aside_ = true; }
    ~Aside() { console_.aside_ = was_; }
    Aside(const Aside&) = delete;
    Aside& operator=(const Aside&) = delete;

   private:
    Console& console_;
    const bool was_;
  };
  void reply(const std::string& document);  // prints it if `json`
  // Prints on err() why something failed or is not as it should be; nothing if `why` is OK.
  void report(const Status& why);

  // A column whose name begins with '>' is right-aligned, for numbers; the others are left-aligned.
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& cells);
  // "name   value", aligned.
  void facts(const std::vector<std::pair<std::string, std::string>>& facts);

 private:
  std::ostream& out_;
  std::ostream& err_;
  bool aside_ = false;
};

// Whether standard input and standard error are a terminal, so that a question can be seen and answered.
bool can_ask();

// Asks "QUESTION [y/N]" on standard error and reads a line of standard input. NOT_CONFIRMED: the answer is not yes.
// `question` ends in a question mark; can_ask() must hold.
Status ask(Console& console, const std::string& question);

using relmap::fixed;
using relmap::time_text;
// "1.2 GB", "340 kB"
std::string bytes_text(std::uint64_t bytes);
// "4.5 s", "3 min 05 s", "3 h 12 min", "12 d 5 h"
std::string duration_text(double seconds);
// "(x, y, z)" in metres
std::string vector_text(const Vector3& v);
// "[######......]": how much of a whole is used
std::string bar_text(std::uint64_t used, std::uint64_t whole);
// The number of terminal columns that UTF-8 text takes: one for each code point.
std::size_t width_of(const std::string& utf8);

}  // namespace relmap::terminal
