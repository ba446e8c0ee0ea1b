// Controls the process that serves a camera on IEEE 1394: starts it, sends it requests, and ends it. A crash or hang is
// reported like other errors.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "frontend/capture/dc1394/file_handle.h"
#include "frontend/capture/dc1394/protocol.h"
#include "proto/base/mutex.h"
#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

// Receives unrequested messages of the process, on a thread of their own.
class ProcessEvents {
 public:
  virtual ~ProcessEvents() = default;
  // A frame or a fault. The process is killed if this does not return ok, since a working process does not send such a
  // message.
  virtual Status told(const Message& message) = 0;
  // The process ended by itself or was killed; `why` is CAMERA_GONE. Not called if the process is ended on purpose.
  virtual void ended(const Status& why) = 0;
};

// Thread-safe.
class CameraProcess {
 public:
  // Starts the program; `events` must outlive this object. UNSUPPORTED if there is no such program, or it is of another
  // release; CAMERA_GONE if it ended or did not send its greeting.
  static Result<std::unique_ptr<CameraProcess>> start(const std::string& program,
                                                      const std::vector<std::string>& arguments, ProcessEvents& events);
  // Uses whatever is at the other end of a socket; if that is a process, `process` is killed and waited for.
  static Result<std::unique_ptr<CameraProcess>> at(FileHandle socket, std::optional<pid_t> process,
                                                   ProcessEvents& events);
  // Closes the socket, which ends the process; kills it after 2 s.
  ~CameraProcess();

  // Sends a request, with a file descriptor if `file` >= 0, and returns the answer if it is ok, or its status
  // otherwise. CAMERA_GONE if the process has ended, or did not answer in time (2 s for registers, 5 s for the rest)
  // and was killed.
  Result<Message> ask(Request request, int file = -1);

 private:
  CameraProcess(FileHandle socket, std::optional<pid_t> process, ProcessEvents& events);
  Status greet();
  Status hung(std::chrono::milliseconds patience) RELMAP_REQUIRES(mutex_);
  void run();
  Status receive();
  Status take(const Message& message);
  std::string reap();

  const FileHandle socket_;
  const std::optional<pid_t> process_;
  ProcessEvents& events_;

  Mutex mutex_;
  ConditionVariable news_;
  std::optional<std::uint64_t> version_ RELMAP_GUARDED_BY(mutex_);                     // from its greeting
  std::map<std::uint32_t, std::optional<Message>> answers_ RELMAP_GUARDED_BY(mutex_);  // of pending requests, by number
  std::uint32_t last_number_ RELMAP_GUARDED_BY(mutex_) = 0;
  std::string killed_for_ RELMAP_GUARDED_BY(mutex_);  // why it was killed; empty if it was not
  Status gone_ RELMAP_GUARDED_BY(mutex_);
  bool ending_ RELMAP_GUARDED_BY(mutex_) = false;

  std::thread reader_;
};

}  // namespace relmap::iidc::dc1394
