#include "tests/support/terminal.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <stdexcept>

#include "storage/testing/temporary_folder.h"

namespace relmap::testing {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kLook{20};

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {
    if (number < 0) throw std::runtime_error("there is no terminal to be had");
  }
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }
  int number() const { return number_; }

 private:
  int number_;
};

}  // namespace

Finished run_on_terminal(const std::vector<std::string>& arguments, const std::string& typed,
                         const std::function<void()>& meanwhile, milliseconds patience) {
  const storage::TemporaryFolder folder;
  const Descriptor keyboard(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));  // and screen
  if (::grantpt(keyboard.number()) != 0 || ::unlockpt(keyboard.number()) != 0)
    throw std::runtime_error("there is no terminal to be had");
  Descriptor terminal(::open(::ptsname(keyboard.number()), O_RDWR | O_NOCTTY | O_CLOEXEC));
  Process process(arguments, {.standard_output = folder / "out", .standard_error = "", .terminal = terminal.number()});
  terminal.close();  // so that the screen ends with the program

  std::string screen;
  bool asked = false;
  const auto deadline = steady_clock::now() + patience;
  for (;;) {
    pollfd look{keyboard.number(), POLLIN, 0};
    ::poll(&look, 1, static_cast<int>(kLook.count()));
    char text[4096];
    if (look.revents != 0) {
      const ssize_t got = ::read(keyboard.number(), text, sizeof text);
      if (got <= 0) break;  // nobody has the terminal open any more
      screen.append(text, static_cast<std::size_t>(got));
    }
    if (!asked && screen.find("[y/N]") != std::string::npos) {
      asked = true;
      if (meanwhile) meanwhile();
      if (::write(keyboard.number(), typed.data(), typed.size()) != static_cast<ssize_t>(typed.size()))
        throw std::runtime_error("nothing can be typed");
    }
    if (steady_clock::now() > deadline) throw std::runtime_error(arguments.front() + " did not end in time: " + screen);
  }
  return {process.wait(patience).value_or(-1), read_text(folder / "out"), screen};
}

}  // namespace relmap::testing
