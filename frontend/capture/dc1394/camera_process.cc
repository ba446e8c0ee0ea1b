#include "frontend/capture/dc1394/camera_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "frontend/capture/dc1394/packet_socket.h"
#include "proto/base/mutex.h"

namespace relmap::iidc::dc1394 {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kRegisterPatience{2000};  // libdc1394 gives up a register within one second
constexpr milliseconds kPatience{5000};          // for requests that access many registers
constexpr milliseconds kEndPatience{2000};

std::string seconds(milliseconds time) { return std::to_string(time.count() / 1000) + " s"; }

Status gone(const std::string& how) {
  return {Reason::CAMERA_GONE, "the process that serves IEEE 1394 has ended (" + how + ")"};
}

// The new process inherits only its socket, standard error and the environment.
Result<pid_t> spawn(const std::string& program, const std::vector<std::string>& arguments, int socket) {
  std::vector<char*> argv = {const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&files, socket, kProtocolFile);
  posix_spawn_file_actions_addclosefrom_np(&files, kProtocolFile + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  pid_t process = -1;
  const int error = ::posix_spawn(&process, program.c_str(), &files, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) return {Reason::UNSUPPORTED, program + " cannot be started: " + std::strerror(error)};
  return process;
}

// Whether the process ended within that time; it must still be reaped.
bool ends_within(pid_t process, milliseconds patience) {
  const FileHandle handle(static_cast<int>(::syscall(SYS_pidfd_open, process, 0)));
  pollfd file{handle.get(), POLLIN, 0};
  const auto until = std::chrono::steady_clock::now() + patience;
  for (;;) {
    const auto left = std::chrono::ceil<milliseconds>(until - std::chrono::steady_clock::now());
    const int ready = ::poll(&file, 1, static_cast<int>(std::max<milliseconds::rep>(0, left.count())));
    if (ready >= 0 || errno != EINTR) return ready > 0;
  }
}

}  // namespace

CameraProcess::CameraProcess(FileHandle socket, std::optional<pid_t> process, ProcessEvents& events)
    : socket_(std::move(socket)), process_(process), events_(events), reader_([this] { run(); }) {}

Result<std::unique_ptr<CameraProcess>> CameraProcess::start(const std::string& program,
                                                            const std::vector<std::string>& arguments,
                                                            ProcessEvents& events) {
  auto ends = socket_pair();
  if (!ends.ok()) return ends.status();
  const auto process = spawn(program, arguments, ends->second.get());
  if (!process.ok()) return process.status();
  ends->second.reset();
  return at(std::move(ends->first), *process, events);
}

Result<std::unique_ptr<CameraProcess>> CameraProcess::at(FileHandle socket, std::optional<pid_t> process,
                                                         ProcessEvents& events) {
  std::unique_ptr<CameraProcess> made(new CameraProcess(std::move(socket), process, events));
  if (Status status = made->greet(); !status.ok()) return status;
  return made;
}

CameraProcess::~CameraProcess() {
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  ::shutdown(socket_.get(), SHUT_RDWR);
  reader_.join();
}

Status CameraProcess::greet() {
  MutexLock lock(mutex_);
  if (!news_.wait_for(mutex_, kPatience, [this]() RELMAP_REQUIRES(mutex_) { return version_ || !gone_.ok(); }))
    return hung(kPatience);
  if (!version_) return gone_;
  if (*version_ != kProtocolVersion)
    return {Reason::UNSUPPORTED, "relmap-camera-1394 is of another release: it speaks version " +
                                     std::to_string(*version_) + " of its protocol, not " +
                                     std::to_string(kProtocolVersion)};
  return {};
}

Result<Message> CameraProcess::ask(Request request, int file) {
  const bool of_register = request.ask == Ask::kRead || request.ask == Ask::kWrite;
  const milliseconds patience = of_register ? kRegisterPatience : kPatience;
  MutexLock lock(mutex_);
  if (!gone_.ok()) return gone_;
  request.number = ++last_number_;
  const auto awaited = answers_.emplace(request.number, std::nullopt).first;
  (void)send_packet(socket_.get(), bytes_of(request), file);  // no answer comes where it could not be sent
  const bool came =
      news_.wait_for(mutex_, patience, [&]() RELMAP_REQUIRES(mutex_) { return awaited->second || !gone_.ok(); });
  const std::optional<Message> answer = awaited->second;
  answers_.erase(awaited);
  if (!came) return hung(patience);
  if (!answer) return gone_;
  if (Status status = answer->status(); !status.ok()) return status;
  return *answer;
}

Status CameraProcess::hung(milliseconds patience) {
  if (killed_for_.empty()) killed_for_ = "it did not answer within " + seconds(patience) + " and was killed";
  ::shutdown(socket_.get(), SHUT_RDWR);  // wakes the reader
  news_.wait(mutex_, [this]() RELMAP_REQUIRES(mutex_) { return !gone_.ok(); });
  return gone_;
}

void CameraProcess::run() {
  const Status rubbish = receive();
  MutexLock lock(mutex_);
  if (!rubbish.ok() && killed_for_.empty())
    killed_for_ = "it spoke nonsense, " + rubbish.message() + ", and was killed";
  const bool kill = !killed_for_.empty();
  lock.unlock();
  ::shutdown(socket_.get(), SHUT_RDWR);
  std::string how = "its end of the socket is closed";
  if (process_) {
    if (kill || !ends_within(*process_, kEndPatience)) ::kill(*process_, SIGKILL);
    how = reap();
  }
  lock.lock();
  const Status end = gone(kill ? killed_for_ : how);
  gone_ = end;
  const bool on_purpose = ending_;
  news_.notify_all();
  lock.unlock();
  if (!on_purpose) events_.ended(end);
}

// Receives until the socket is closed at either end. Returns an error if an invalid message arrived.
Status CameraProcess::receive() {
  std::array<std::uint8_t, sizeof(Message)> buffer;
  for (;;) {
    const auto packet = receive_packet(socket_.get(), buffer);
    if (!packet.ok()) return {};
    if (packet->size > buffer.size())
      return {Reason::CORRUPT, "a packet of " + std::to_string(packet->size) + " bytes"};
    const auto message = parse_message({buffer.data(), packet->size});
    if (!message.ok()) return message.status();
    if (Status status = take(*message); !status.ok()) return status;
  }
}

Status CameraProcess::take(const Message& message) {
  if (message.tell == Tell::kFrame || message.tell == Tell::kFault) return events_.told(message);
  const MutexLock lock(mutex_);
  if (message.tell == Tell::kHello) {
    version_ = message.values[0];
  } else {
    const auto awaited = answers_.find(message.number);
    if (awaited != answers_.end())
      awaited->second = message;
    else if (killed_for_.empty())
      return {Reason::CORRUPT, "an answer to request " + std::to_string(message.number) + ", which is not open"};
  }
  news_.notify_all();
  return {};
}

std::string CameraProcess::reap() {
  int status = 0;
  pid_t reaped;
  do reaped = ::waitpid(*process_, &status, 0);
  while (reaped < 0 && errno == EINTR);
  if (reaped < 0) return "how is not known";  // somebody else waits for all children
  if (WIFSIGNALED(status)) return "signal " + std::to_string(WTERMSIG(status));
  return "exit status " + std::to_string(WEXITSTATUS(status));
}

}  // namespace relmap::iidc::dc1394
