#include "tools/terminal/child_daemon.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

namespace relmap::terminal {

std::string ChildDaemon::End::words() const {
  return WIFEXITED(status) ? "exit code " + std::to_string(WEXITSTATUS(status))
                           : "signal " + std::to_string(WTERMSIG(status));
}

Result<ChildDaemon> ChildDaemon::start(const std::vector<std::string>& arguments, const std::string& log, int if_left) {
  std::error_code error;
  const auto own = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string program = (own.parent_path() / "relmapd").string();
  if (::access(program.c_str(), X_OK) != 0) return Status(Reason::NO_SUCH_FILE, program);
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const int none = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  const int file = log.empty() ? -1 : ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, S_IRUSR | S_IWUSR);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, if_left);
    if (::getppid() != parent) ::_exit(1);
    ::setpgid(0, 0);  // Ctrl-C at the terminal is this program's, which then stops it
    ::dup2(none, STDIN_FILENO);
    ::dup2(none, STDOUT_FILENO);
    if (!log.empty()) ::dup2(file < 0 ? none : file, STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(1);
  }
  const int failed = errno;
  if (file >= 0) ::close(file);
  if (none >= 0) ::close(none);
  if (child < 0) return Status(Reason::INTERNAL, program + ": " + std::strerror(failed));
  return ChildDaemon(child, if_left);
}

ChildDaemon::~ChildDaemon() {
  if (pid_ < 0) return;
  ::kill(pid_, if_left_);
  while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::optional<ChildDaemon::End> ChildDaemon::ended() {
  int status = 0;
  if (pid_ < 0 || ::waitpid(pid_, &status, WNOHANG) != pid_) return {};
  pid_ = -1;
  return End{status};
}

void ChildDaemon::ask_to_end() const {
  if (pid_ >= 0) ::kill(pid_, SIGTERM);
}

}  // namespace relmap::terminal
