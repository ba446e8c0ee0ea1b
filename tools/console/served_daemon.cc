#include "tools/console/served_daemon.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <thread>

#include "client/relmap_client.h"
#include "client/server_address.h"

namespace relmap::console {

namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kLook{10};

}  // namespace

bool needs_daemon(const std::string& server) {
  std::error_code error;
  if (!fs::exists(server + "/FORMAT", error)) return false;
  client::ClientOptions options;
  options.connect_timeout = std::chrono::milliseconds(2000);
  return client::Client::connect(server, options).reason() == Reason::UNREACHABLE;
}

Result<std::unique_ptr<OwnDaemon>> OwnDaemon::start(const std::string& folder, const std::function<bool()>& going) {
  std::error_code error;
  const std::string program = (fs::read_symlink("/proc/self/exe", error).parent_path() / "relmapd").string();
  if (::access(program.c_str(), X_OK) != 0)
    return Status(Reason::NO_SUCH_FILE, "no daemon serves " + folder + ", and there is no " + program + " to start");
  std::array<std::string, 3> arguments{program, "--data", folder};
  std::array<char*, 4> argv{arguments[0].data(), arguments[1].data(), arguments[2].data(), nullptr};
  const int none = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(1);
    ::setpgid(0, 0);  // Ctrl-C at the terminal is the console's, which then stops it
    ::dup2(none, STDIN_FILENO);
    ::dup2(none, STDOUT_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(1);
  }
  if (none >= 0) ::close(none);
  if (child < 0) return Status(Reason::INTERNAL, program + ": " + std::strerror(errno));
  std::unique_ptr<OwnDaemon> daemon(new OwnDaemon(child));
  for (;; std::this_thread::sleep_for(kLook)) {
    if (const auto end = daemon->ended())
      return Status(Reason::INTERNAL, "relmapd --data " + folder + " ended with " + *end + "; its log above says why");
    if (!going()) return Status(Reason::SHUTTING_DOWN, "stopped while relmapd was starting");
    const auto where = client::resolve_server(folder);
    if (where.ok() && where->pid == child) return daemon;
  }
}

OwnDaemon::~OwnDaemon() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGTERM);
  while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::optional<std::string> OwnDaemon::ended() {
  int status = 0;
  if (pid_ < 0) return "an end that was told already";
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return {};
  pid_ = -1;
  return WIFEXITED(status) ? "exit code " + std::to_string(WEXITSTATUS(status))
                           : "signal " + std::to_string(WTERMSIG(status));
}

}  // namespace relmap::console
