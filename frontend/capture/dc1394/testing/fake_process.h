// A fake of a camera's process: a thread of the test at the other end of the socket, which sends what the test wants.
#pragma once

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "frontend/capture/dc1394/frame_ring.h"
#include "frontend/capture/dc1394/packet_socket.h"
#include "frontend/capture/dc1394/protocol.h"

namespace relmap::iidc::dc1394::testing {

class FakeProcess {
 public:
  // Fills in the answer to a request, which is ok by default. No answer is sent if it returns false.
  std::function<bool(const Request&, Message&)> answers = [](const Request&, Message&) { return true; };
  Message hello = Message::hello();

  ~FakeProcess() {
    end();
    if (thread_.joinable()) thread_.join();
  }

  // Starts the thread and returns the client's end of the socket.
  FileHandle begin() {
    auto ends = socket_pair().or_throw();
    socket_ = std::move(ends.second);
    thread_ = std::thread([this] { run(); });
    return std::move(ends.first);
  }
  void say(const Message& message) { (void)send_packet(socket_.get(), bytes_of(message)); }
  void say(const std::vector<std::uint8_t>& bytes) { (void)send_packet(socket_.get(), bytes); }
  void end() { ::shutdown(socket_.get(), SHUT_RDWR); }
  std::shared_ptr<FrameRing> ring() const { return std::atomic_load(&ring_); }

  // Sends a frame filled with one byte. False if no slot is free.
  bool send_frame(std::uint8_t content, std::int64_t arrival_us = 0, std::uint64_t overrun = 0) {
    const auto slot = ring()->take();
    if (!slot) return false;
    std::fill_n(ring()->slot(*slot), ring()->frame_bytes(), content);
    say(Message::frame(*slot, ring()->frame_bytes(), arrival_us, overrun));
    return true;
  }

 private:
  void run() {
    say(hello);
    std::array<std::uint8_t, sizeof(Request)> buffer;
    for (;;) {
      auto packet = receive_packet(socket_.get(), buffer);
      if (!packet.ok()) return;
      const auto request = parse_request({buffer.data(), packet->size});
      if (!request.ok()) return;
      if (request->ask == Ask::kStart)
        std::atomic_store(&ring_, FrameRing::map(std::move(packet->file), request->count, request->amount).or_throw());
      Message message = Message::answer(request->number, {});
      if (answers(*request, message)) say(message);
    }
  }

  FileHandle socket_;
  std::shared_ptr<FrameRing> ring_;
  std::thread thread_;
};

}  // namespace relmap::iidc::dc1394::testing
