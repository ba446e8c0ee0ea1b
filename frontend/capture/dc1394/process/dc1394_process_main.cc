// relmap-camera-1394: one camera, for the program that started it.
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <thread>

#include "frontend/capture/dc1394/packet_socket.h"
#include "frontend/capture/dc1394/process/library_log.h"
#include "frontend/capture/dc1394/process/served_camera.h"
#include "frontend/capture/dc1394/protocol.h"
#include "proto/base/version.h"

namespace relmap::iidc::dc1394 {

namespace {

constexpr std::chrono::seconds kEndPatience{2};

bool tell(const Message& message) { return send_packet(kProtocolFile, bytes_of(message)).ok(); }

// Ends this process when the program that started it has ended, even if libdc1394 hangs in the main thread.
void end_with_socket() {
  std::thread([] {
    pollfd file{kProtocolFile, POLLRDHUP, 0};
    while (::poll(&file, 1, -1) <= 0) {
    }
    std::this_thread::sleep_for(kEndPatience);
    ::_exit(1);
  }).detach();
}

class Server {
 public:
  explicit Server(bool usb_too) : usb_too_(usb_too) {}

  Message answer(const Request& request, FileHandle file) {
    Message message = Message::answer(request.number, {});
    const Status status = serve(request, std::move(file), message);
    return status.ok() ? message : Message::answer(request.number, status);
  }
  void silence() {
    if (camera_) camera_->silence();
  }

 private:
  Status serve(const Request& request, FileHandle file, Message& message) {
    if (request.ask == Ask::kList) return list(message);
    if (request.ask == Ask::kOpen) return open(request.subject, message);
    if (!camera_) return {Reason::WRONG_STATE, "no camera was opened"};
    switch (request.ask) {
      case Ask::kRead: {
        std::array<std::uint32_t, kMaxQuadlets> quadlets;
        if (request.count > quadlets.size()) return {Reason::INVALID_ARGUMENT, "too many registers at once"};
        const std::span part(quadlets.data(), request.count);
        if (Status status = camera_->read(request.subject, part); !status.ok()) return status;
        message.with(std::vector<std::uint64_t>(part.begin(), part.end()));
        return {};
      }
      case Ask::kWrite:
        return camera_->write(request.subject, static_cast<std::uint32_t>(request.amount));
      case Ask::kStart: {
        auto ring = FrameRing::map(std::move(file), request.count, request.amount);
        return ring.ok() ? camera_->start(std::move(*ring), request.subject) : ring.status();
      }
      default:
        camera_->stop();
        return {};
    }
  }

  Status list(Message& message) {
    const Library library(dc1394_new());
    if (!library) return library_error(Reason::UNSUPPORTED, "libdc1394 finds neither IEEE 1394 nor USB");
    const auto guids = list_cameras(*library);
    if (!guids.ok()) return guids.status();
    message.with(*guids);
    return {};
  }

  Status open(std::uint64_t guid, Message& message) {
    if (camera_) return {Reason::WRONG_STATE, "a camera is open already"};
    auto camera = ServedCamera::open(guid, usb_too_, &tell);
    if (!camera.ok()) return camera.status();
    camera_ = std::move(*camera);
    message.with(camera_->place());
    return {};
  }

  const bool usb_too_;
  std::unique_ptr<ServedCamera> camera_;
};

int run(bool usb_too) {
  // This process ends with its socket and not by the signals that end its parent, which may still want to stop the
  // camera.
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) ::signal(number, SIG_IGN);
  keep_library_log();
  end_with_socket();
  if (!tell(Message::hello())) return 1;
  Server server(usb_too);
  std::array<std::uint8_t, sizeof(Request)> buffer;
  for (;;) {
    auto packet = receive_packet(kProtocolFile, buffer);
    if (!packet.ok()) break;
    const auto request = parse_request({buffer.data(), std::min(packet->size, buffer.size())});
    if (!request.ok() || !tell(server.answer(*request, std::move(packet->file)))) break;
  }
  server.silence();
  ::_exit(0);
}

}  // namespace

}  // namespace relmap::iidc::dc1394

int main(int count, char** arguments) {
  using namespace relmap::iidc::dc1394;
  const auto asked_for = [&](const char* option) { return count == 2 && std::strcmp(arguments[1], option) == 0; };
  if (asked_for("--version")) return std::puts(relmap::version_line().c_str()) < 0;
  if (asked_for("--help"))
    return std::puts(
               "relmap-camera-1394 serves a camera on IEEE 1394 to the program of relmap that starts it; by itself "
               "it does nothing. See relmap-camera --help and relmap-frontend --help.") < 0;
  int type = 0;
  socklen_t size = sizeof type;
  const bool usb_too = count == 2 && std::strcmp(arguments[1], "--usb-too") == 0;
  if (count > 2 || (count == 2 && !usb_too) || ::getsockopt(kProtocolFile, SOL_SOCKET, SO_TYPE, &type, &size) != 0 ||
      type != SOCK_SEQPACKET) {
    std::fputs("relmap-camera-1394 serves a camera on IEEE 1394 to the program of relmap that starts it\n", stderr);
    return 2;
  }
  return run(usb_too);
}
