#include "tools/relmap-admin/drill_daemon.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <thread>
#include <vector>

#include "client/server_address.h"
#include "proto/base/version.h"

namespace relmap::admin {

namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kLook{50};

std::string last_line(const std::string& file) {
  std::ifstream in(file);
  std::string last;
  for (std::string line; std::getline(in, line);)
    if (!line.empty()) last = line;
  return last;
}

// The reason that a line of the daemon's log names: its first word that is one.
Reason reason_in(const std::string& line) {
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t begin = line.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ", at);
    if (begin == std::string::npos) break;
    const std::size_t end = std::min(line.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ_", begin), line.size());
    for (std::uint16_t number = 1; number < 1000; ++number)
      if (is_reason(number) && reason_name(static_cast<Reason>(number)) == line.substr(begin, end - begin))
        return static_cast<Reason>(number);
    at = end;
  }
  return Reason::INTERNAL;
}

pid_t run(const std::vector<std::string>& arguments, const std::string& log) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, S_IRUSR | S_IWUSR);
  const int none = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    ::setpgid(0, 0);  // Ctrl-C at the terminal is the drill's, which then stops it
    ::dup2(none, STDIN_FILENO);
    ::dup2(none, STDOUT_FILENO);
    ::dup2(file < 0 ? none : file, STDERR_FILENO);
    ::execv(argv[0], argv.data());
    ::_exit(1);
  }
  if (file >= 0) ::close(file);
  if (none >= 0) ::close(none);
  return child;
}

}  // namespace

Result<std::unique_ptr<DrillDaemon>> DrillDaemon::start(const std::string& map, const std::string& log,
                                                        const std::string& vocabulary,
                                                        const std::function<Status()>& going) {
  std::error_code error;
  const std::string program = (fs::read_symlink("/proc/self/exe", error).parent_path() / "relmapd").string();
  if (::access(program.c_str(), X_OK) != 0)
    return Status(Reason::NO_SUCH_FILE,
                  "there is no " + program + ": the drill starts the relmapd beside this program");
  std::vector<std::string> arguments{program, "--data", map, "--listen", "none", "--lcm", "none"};
  if (!vocabulary.empty()) arguments.insert(arguments.end(), {"--vocabulary", vocabulary});
  const pid_t pid = run(arguments, log);
  if (pid < 0) return Status(Reason::INTERNAL, program + ": " + std::strerror(errno));
  std::unique_ptr<DrillDaemon> daemon(new DrillDaemon(pid, log));
  if (Status serves = daemon->wait_until_it_serves(map, going); !serves.ok()) return serves;
  const auto status = daemon->client().status();
  if (!status.ok()) return status.status();
  if (status->version != version())
    return Status(Reason::UNSUPPORTED,
                  program + " is of release " + status->version + ", this program of " + std::string(version()));
  return daemon;
}

DrillDaemon::~DrillDaemon() {
  if (pid_ < 0) return;
  client_.reset();
  ::kill(pid_, SIGKILL);
  (void)::waitpid(pid_, nullptr, 0);
}

Status DrillDaemon::wait_until_it_serves(const std::string& map, const std::function<Status()>& going) {
  for (;; std::this_thread::sleep_for(kLook)) {
    if (const auto end = ended()) return end->ok() ? Status(Reason::INTERNAL, "relmapd ended before it served") : *end;
    if (Status go = going(); !go.ok()) return go;
    const auto where = client::resolve_server(map);
    if (!where.ok() || where->pid != pid_) continue;
    auto client = client::Client::connect(map);
    if (!client.ok()) return client.status();
    client_ = std::move(*client);
    return {};
  }
}

std::optional<Status> DrillDaemon::ended() {
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return {};
  pid_ = -1;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return Status();
  const std::string how = WIFEXITED(status) ? "exit code " + std::to_string(WEXITSTATUS(status))
                                            : "signal " + std::to_string(WTERMSIG(status));
  const std::string line = last_line(log_);
  return Status(reason_in(line), "relmapd ended with " + how + ": " + line);
}

Status DrillDaemon::stop() {
  client_.reset();
  ::kill(pid_, SIGTERM);
  for (;;) {
    if (const auto end = ended()) return *end;
    std::this_thread::sleep_for(kLook);
  }
}

}  // namespace relmap::admin
