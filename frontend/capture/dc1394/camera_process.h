// The process that serves a camera on IEEE 1394, from outside: it is started, asked, and ended; when it crashes or
// hangs, that is an answer like others.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "frontend/capture/dc1394/file_handle.h"
#include "frontend/capture/dc1394/protocol.h"
#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// What it does unasked; told by a thread of its own.
class ProcessEvents {
 public:
  virtual ~ProcessEvents() = default;
  // Frames and faults. Not OK: no sane process says that; it is killed.
  virtual Status told(const Message& message) = 0;
  // By itself, or killed; it is not called where the process is ended on purpose. CAMERA_GONE.
  virtual void ended(const Status& why) = 0;
};

// Thread-safe.
class CameraProcess {
 public:
  // `events` must outlive it. UNSUPPORTED: there is no such program, or it is of another release; CAMERA_GONE: it ended
  // or did not greet.
  static Result<std::unique_ptr<CameraProcess>> start(const std::string& program,
                                                      const std::vector<std::string>& arguments, ProcessEvents& events);
  // At the other end of a socket, whoever that is; `process`: to be killed and waited for, if it is one.
  static Result<std::unique_ptr<CameraProcess>> at(FileHandle socket, std::optional<pid_t> process,
                                                   ProcessEvents& events);
  // It ends with its socket; it is killed if that takes more than 2 s.
  ~CameraProcess();

  // The answer where it is OK, else its status. CAMERA_GONE: the process has ended, or did not answer in time (2 s for
  // registers, 5 s for the rest) and was killed. `file` goes with the request.
  Result<Message> ask(Request request, int file = -1);

 private:
  CameraProcess(FileHandle socket, std::optional<pid_t> process, ProcessEvents& events);
  Status greet();
  Status hung(std::unique_lock<std::mutex>& lock, std::chrono::milliseconds patience);
  void run();
  Status receive();
  Status take(const Message& message);
  std::string reap();

  const FileHandle socket_;
  const std::optional<pid_t> process_;
  ProcessEvents& events_;

  std::mutex mutex_;  // of what follows
  std::condition_variable news_;
  std::optional<std::uint64_t> version_;                     // that it greeted with
  std::map<std::uint32_t, std::optional<Message>> answers_;  // awaited
  std::uint32_t last_number_ = 0;
  std::string killed_for_;  // empty: it is not to be killed
  Status gone_;
  bool ending_ = false;

  std::thread reader_;
};

}  // namespace relmap::iidc::dc1394
