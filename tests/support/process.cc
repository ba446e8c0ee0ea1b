#include "tests/support/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"

namespace relmap::testing {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr int kNoNetwork = 125, kNoProgram = 127;

void redirect(int descriptor, const std::string& path) {
  const int file = ::open(path.empty() ? "/dev/null" : path.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  if (file >= 0) ::dup2(file, descriptor);
}

}  // namespace

std::string built_program(const std::string& name) { return std::string(RELMAP_BIN_DIR) + "/" + name; }

Process::Process(const std::vector<std::string>& arguments, const ProcessOptions& options) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ < 0) throw std::runtime_error("fork failed");
  if (pid_ == 0) {
    if (options.own_network && !enter_private_network(*options.own_network)) ::_exit(kNoNetwork);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // a change of users would have undone it
    if (::getppid() != parent) ::_exit(kNoProgram);
    redirect(STDOUT_FILENO, options.standard_output);
    redirect(STDERR_FILENO, options.standard_error);
    if (options.terminal >= 0)
      for (const int descriptor : {STDIN_FILENO, STDERR_FILENO}) ::dup2(options.terminal, descriptor);
    for (const std::string& variable : options.environment) ::putenv(const_cast<char*>(variable.c_str()));
    ::execvp(argv[0], argv.data());
    ::_exit(kNoProgram);
  }
}

Process::~Process() { kill(); }

bool Process::running() { return !wait(milliseconds(0)).has_value(); }

void Process::signal(int number) {
  if (running()) ::kill(pid_, number);
}

void Process::kill() {
  signal(SIGKILL);
  while (!wait(milliseconds(1000)).has_value()) {
  }
}

std::optional<int> Process::wait(milliseconds patience) {
  const auto deadline = steady_clock::now() + patience;
  while (!exit_code_) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_)
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    else if (steady_clock::now() >= deadline)
      return std::nullopt;
    else
      std::this_thread::sleep_for(milliseconds(2));
  }
  return exit_code_;
}

std::size_t Process::peak_resident_bytes() const {
  std::ifstream status("/proc/" + std::to_string(pid_) + "/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stoull(line.substr(6)) * 1024;
  throw std::runtime_error("no VmHWM of process " + std::to_string(pid_));
}

double Process::cpu_seconds() const {
  const std::string text = read_text("/proc/" + std::to_string(pid_) + "/stat");
  // The name, in parentheses, may hold blanks. User and system time are fields 14 and 15, in clock ticks.
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::string skipped;
  for (int field = 3; field < 14; ++field) fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

Finished run_program(const std::vector<std::string>& arguments, milliseconds patience,
                     const std::vector<std::string>& environment) {
  const storage::TemporaryFolder folder;
  ProcessOptions options{folder / "out", folder / "err"};
  options.environment = environment;
  Process process(arguments, options);
  const auto code = process.wait(patience);
  Finished finished{code.value_or(-1), read_text(folder / "out"), read_text(folder / "err")};
  if (!code) throw std::runtime_error(arguments.front() + " did not end in time: " + finished.standard_error);
  return finished;
}

std::string read_text(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace relmap::testing
