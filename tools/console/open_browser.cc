#include "tools/console/open_browser.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "proto/base/markup.h"

namespace relmap::console {

namespace {

Status failed(const std::string& what) { return {Reason::IO_ERROR, "--open: " + what + ": " + std::strerror(errno)}; }

// Whether it is a folder that only this user can look into.
bool is_private(const std::string& folder) {
  struct stat found {};
  return ::stat(folder.c_str(), &found) == 0 && S_ISDIR(found.st_mode) && found.st_uid == ::getuid() &&
         (found.st_mode & (S_IRWXG | S_IRWXO)) == 0;
}

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value ? std::string(value) : std::string();
}

std::string page_to(const std::string& address) {
  const std::string text = markup_text(address);
  return "<!doctype html><meta charset=\"utf-8\"><meta name=\"referrer\" content=\"no-referrer\"><title>relmap "
         "console</title><meta http-equiv=\"refresh\" content=\"0; url=" +
         text + "\"><a href=\"" + text + "\">relmap console</a>\n";
}

bool write_all(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

// Runs a program of which nobody waits for the end. It inherits no file of this process, whose sockets it would keep
// open.
void start(const char* program, std::string argument) {
  char* const argv[] = {const_cast<char*>(program), argument.data(), nullptr};
  const pid_t child = ::fork();
  if (child == 0) {
    if (::fork() != 0) ::_exit(0);
    ::setsid();  // Ctrl-C is not for the browser
    ::signal(SIGPIPE, SIG_DFL);
    const int none = ::open("/dev/null", O_RDWR);
    ::dup2(none, STDIN_FILENO);
    ::dup2(none, STDOUT_FILENO);
    ::close_range(STDERR_FILENO + 1, ~0U, 0);
    ::execvp(argv[0], argv);
    static constexpr std::string_view kNone = "--open: there is no xdg-open\n";
    (void)!::write(STDERR_FILENO, kNone.data(), kNone.size());
    ::_exit(1);
  }
  while (child > 0 && ::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

}  // namespace

Result<std::unique_ptr<OpenedBrowser>> OpenedBrowser::open(const std::string& address) {
  std::unique_ptr<OpenedBrowser> opened(new OpenedBrowser);
  std::string folder = variable("XDG_RUNTIME_DIR");
  if (!is_private(folder)) {
    const std::string temporary = variable("TMPDIR");
    folder = (temporary.empty() ? "/tmp" : temporary) + "/relmap-console-XXXXXX";
    if (!::mkdtemp(folder.data())) return failed(folder);
    opened->folder_ = folder;
  }
  std::string page = folder + "/relmap-console-XXXXXX.html";
  const int file = ::mkostemps(page.data(), static_cast<int>(std::strlen(".html")), O_CLOEXEC);  // of mode 0600
  if (file < 0) return failed(page);
  opened->page_ = page;
  const bool written = write_all(file, page_to(address));
  if (::close(file) != 0 || !written) return failed(page);
  start("xdg-open", "file://" + page);
  return opened;
}

OpenedBrowser::~OpenedBrowser() {
  if (!page_.empty()) ::unlink(page_.c_str());
  if (!folder_.empty()) ::rmdir(folder_.c_str());
}

}  // namespace relmap::console
