#include "tests/camera/usb_port.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

namespace relmap::testing {

namespace {

constexpr std::size_t kPacket = 512;  // of bulk transfers at high speed

using Bytes = std::vector<std::uint8_t>;

// Answers of a device to the host's standard requests.
std::optional<Bytes> standard_answer(const std::uint8_t setup[8], const SimulatedCameraOptions& camera) {
  constexpr std::uint8_t kGetDescriptor = 6, kString = 3;
  if (setup[0] != 0x80 || setup[1] != kGetDescriptor || setup[3] != kString) return std::nullopt;
  if (setup[2] == 0) return Bytes{4, kString, 0x09, 0x04};
  if (setup[2] > 2) return std::nullopt;
  const std::string& text = setup[2] == 1 ? camera.vendor : camera.model;
  Bytes answer = {static_cast<std::uint8_t>(2 + 2 * text.size()), kString};
  for (const char letter : text) answer.insert(answer.end(), {static_cast<std::uint8_t>(letter), 0});
  return answer;
}

struct Setup {
  std::uint64_t address;
  std::size_t length;
};

Setup parse(const std::uint8_t setup[8]) {
  const auto word = [&](int at) { return static_cast<std::uint64_t>(setup[at] | setup[at + 1] << 8); };
  return {0xffff'0000'0000 | word(4) << 16 | word(2), static_cast<std::size_t>(word(6))};
}

constexpr std::uint8_t kRegisters = 0x7f;  // the request: addresses that begin with 0xffff

}  // namespace

void UsbTransfer::copy_to(std::uint8_t* buffer) const {
  for (const Piece& piece : pieces) {
    std::memcpy(buffer, piece.bytes->data() + piece.from, piece.size);
    buffer += piece.size;
  }
}

ReadyFile::ReadyFile(std::string path) : path_(std::move(path)) {
  if (::mkfifo(path_.c_str(), 0666) != 0) throw std::system_error(errno, std::generic_category(), path_);
  file_ = ::open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file_ < 0) throw std::system_error(errno, std::generic_category(), path_);
  ::fcntl(file_, F_SETPIPE_SZ, 1);  // one page, which a single byte keeps
  set(false);
}

ReadyFile::~ReadyFile() {
  ::close(file_);
  ::unlink(path_.c_str());
}

void ReadyFile::set(bool ready) {
  if (ready == ready_) return;
  char byte = 0;
  const auto done = ready ? ::read(file_, &byte, 1) : ::write(file_, &byte, 1);
  if (done != 1) throw std::system_error(errno, std::generic_category(), path_);
  ready_ = ready;
}

UsbPort::UsbPort(std::shared_ptr<SimulatedCamera> camera, const std::string& device_file)
    : camera_(std::move(camera)), ready_(device_file) {
  camera_->restart();
  camera_->on_change([this] { changed(); });
  pacer_ = std::thread([this] { run(); });
}

UsbPort::~UsbPort() {
  unplug();
  pacer_.join();
}

int UsbPort::claim(UsbClient client) {
  const std::lock_guard lock(mutex_);
  if (gone_) return -ENODEV;
  if (camera_->faults().busy || (claimed_by_ && claimed_by_ != client)) return -EBUSY;
  claimed_by_ = client;
  return 0;
}

int UsbPort::release(UsbClient client) {
  const std::lock_guard lock(mutex_);
  if (gone_) return -ENODEV;
  if (claimed_by_ != client) return -EINVAL;
  claimed_by_ = nullptr;
  return 0;
}

int UsbPort::set_configuration() {
  const std::lock_guard lock(mutex_);
  if (gone_) return -ENODEV;
  return claimed_by_ || camera_->faults().busy ? -EBUSY : 0;
}

int UsbPort::clear_halt() {
  const std::lock_guard lock(mutex_);
  if (gone_) return -ENODEV;
  halted_ = false;
  return 0;
}

int UsbPort::reset() {
  {
    const std::lock_guard lock(mutex_);
    if (gone_) return -ENODEV;
    halted_ = false;
    end_transmission();
    finish_all(-EPROTO);
  }
  camera_->restart();
  return 0;
}

int UsbPort::submit_bulk(UsbTransfer transfer) {
  const std::lock_guard lock(mutex_);
  if (gone_) return -ENODEV;
  const CameraFaults faults = camera_->faults();
  if (faults.no_bandwidth) return -ENOSPC;
  if (faults.busy || (claimed_by_ && claimed_by_ != transfer.client)) return -EBUSY;
  claimed_by_ = transfer.client;  // as Linux does, with a warning
  advance(SimulatedCamera::Clock::now());
  ++counters_.bulk_transfers;
  if (halted_) {
    finish(std::move(transfer), -EPIPE);
    return 0;
  }
  waiting_.push_back(std::move(transfer));
  counters_.max_waiting = std::max(counters_.max_waiting, waiting_.size());
  return 0;
}

int UsbPort::submit_control(UsbTransfer transfer, const std::uint8_t setup[8], const std::uint8_t* data) {
  const Setup request = parse(setup);
  auto answer = std::make_shared<Bytes>();
  auto outcome = SimulatedCamera::Answer::kRefused;
  if (const auto standard = standard_answer(setup, camera_->options())) {
    *answer = *standard;
    outcome = SimulatedCamera::Answer::kDone;
  } else if (setup[1] == kRegisters && (setup[0] == 0xc0 || setup[0] == 0x40) && request.length % 4 == 0) {
    const bool reads = setup[0] == 0xc0;
    outcome = SimulatedCamera::Answer::kDone;
    for (std::size_t i = 0; i < request.length && outcome == SimulatedCamera::Answer::kDone; i += 4) {
      std::uint32_t quadlet = 0;
      if (!reads)
        for (int byte = 3; byte >= 0; --byte) quadlet = quadlet << 8 | data[i + static_cast<std::size_t>(byte)];
      outcome = reads ? camera_->read(request.address + i, quadlet) : camera_->write(request.address + i, quadlet);
      for (int shift = 0; reads && shift < 32; shift += 8)
        answer->push_back(static_cast<std::uint8_t>(quadlet >> shift));
    }
    if (!reads) transfer.actual = request.length;
  }
  const std::lock_guard lock(mutex_);
  if (gone_) return -ENODEV;
  ++counters_.control_transfers;
  if (outcome == SimulatedCamera::Answer::kNone) {
    transfer.actual = 0;
    ++counters_.unanswered;
    unanswered_.push_back(std::move(transfer));
  } else if (outcome == SimulatedCamera::Answer::kRefused) {
    transfer.actual = 0;
    finish(std::move(transfer), -EPIPE);
  } else {
    if (setup[0] & 0x80) {
      transfer.actual = std::min({answer->size(), request.length, transfer.length});
      transfer.pieces.push_back({answer, 0, transfer.actual});
    }
    finish(std::move(transfer), 0);
  }
  return 0;
}

int UsbPort::discard(UsbClient client, std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  if (gone_) return -ENODEV;
  advance(SimulatedCamera::Clock::now());
  const auto take_from = [&](auto& queue) {
    const auto found = std::find_if(queue.begin(), queue.end(), [&](const UsbTransfer& transfer) {
      return transfer.client == client && transfer.id == id;
    });
    if (found == queue.end()) return false;
    UsbTransfer transfer = std::move(*found);
    queue.erase(found);
    ++counters_.discarded;
    finish(std::move(transfer), -ENOENT);
    return true;
  };
  return take_from(waiting_) || take_from(unanswered_) ? 0 : -EINVAL;
}

int UsbPort::reap(UsbClient client, UsbTransfer& transfer) {
  const std::lock_guard lock(mutex_);
  const auto found = done_.find(client);
  if (found == done_.end()) return gone_ ? -ENODEV : -EAGAIN;
  transfer = std::move(found->second.front());
  found->second.pop_front();
  if (found->second.empty()) done_.erase(found);
  ready_.set(!done_.empty());
  return 0;
}

void UsbPort::closed_by(UsbClient client) {
  const std::lock_guard lock(mutex_);
  const auto of_client = [&](const UsbTransfer& transfer) { return transfer.client == client; };
  std::erase_if(waiting_, of_client);
  std::erase_if(unanswered_, of_client);
  done_.erase(client);
  ready_.set(!done_.empty());
  if (claimed_by_ == client) claimed_by_ = nullptr;
}

void UsbPort::unplug() {
  camera_->on_change({});
  const std::lock_guard lock(mutex_);
  if (gone_) return;
  advance(SimulatedCamera::Clock::now());
  end_transmission();
  gone_ = true;
  claimed_by_ = nullptr;
  finish_all(-ESHUTDOWN);
  event_.notify_all();
}

bool UsbPort::plugged() const {
  const std::lock_guard lock(mutex_);
  return !gone_;
}

bool UsbPort::wait_for_mid_frame(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  const auto deadline = SimulatedCamera::Clock::now() + patience;
  while (SimulatedCamera::Clock::now() < deadline && !gone_) {
    advance(SimulatedCamera::Clock::now());
    if (transmission_ && 2 * transmission_->sent >= transmission_->bytes->size()) return true;
    event_.wait_for(lock, std::chrono::milliseconds(1));
  }
  return false;
}

UsbCounters UsbPort::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

void UsbPort::changed() {
  const std::lock_guard lock(mutex_);
  woken_ = true;
  event_.notify_all();
}

void UsbPort::run() {
  std::unique_lock lock(mutex_);
  while (!gone_) {
    if (transmission_) {
      event_.wait_until(lock, transmission_->end, [&] { return gone_ || !transmission_; });
      advance(SimulatedCamera::Clock::now());
      continue;
    }
    const auto due = camera_->next_start();
    const auto interrupted = [&] { return gone_ || woken_; };
    if (due)
      event_.wait_until(lock, *due, interrupted);
    else
      event_.wait(lock, interrupted);
    woken_ = false;
    lock.unlock();  // a frame takes its time
    auto frame = camera_->take_frame(SimulatedCamera::Clock::now());
    lock.lock();
    if (frame && !gone_) begin(std::move(*frame));
  }
}

void UsbPort::begin(SimulatedCamera::Frame frame) {
  if (frame.stalls) {
    halted_ = true;
    finish_all(-EPIPE);
  } else if (frame.bytes.empty()) {
    return;
  }
  ++counters_.frames;
  if (halted_ || waiting_.empty()) {
    ++counters_.lost;
    return;
  }
  transmission_ =
      Transmission{std::make_shared<const Bytes>(std::move(frame.bytes)), frame.start, frame.end, frame.ends};
}

// What the bus has brought by now, in whole packets.
void UsbPort::advance(SimulatedCamera::Clock::time_point now) {
  if (!transmission_) return;
  Transmission& frame = *transmission_;
  const std::size_t size = frame.bytes->size();
  if (now >= frame.end) {
    send(size);
    if (transmission_) end_transmission();
    return;
  }
  const double part = std::chrono::duration<double>(now - frame.start) / (frame.end - frame.start);
  send(static_cast<std::size_t>(std::max(0.0, part) * static_cast<double>(size)) / kPacket * kPacket);
}

void UsbPort::send(std::size_t to) {
  Transmission& frame = *transmission_;
  const std::size_t size = frame.bytes->size();
  while (frame.sent < to) {
    if (waiting_.empty()) {
      frame.cut = true;
      frame.sent = to;
      return;
    }
    UsbTransfer& transfer = waiting_.front();
    const std::size_t count = std::min(to - frame.sent, transfer.length - transfer.actual);
    if (count > 0) transfer.pieces.push_back({frame.bytes, frame.sent, count});
    transfer.actual += count;
    frame.sent += count;
    if (const std::size_t rest = frame.sent % kPacket; rest != 0 && frame.sent < size) {  // more than it has room for
      frame.sent = std::min(size, frame.sent + kPacket - rest);
      finish_first(-EOVERFLOW);
    } else if (transfer.actual == transfer.length) {
      finish_first(0);
    } else if (frame.sent == size && (frame.ends || size % kPacket != 0)) {
      finish_first(transfer.error_if_short ? -EREMOTEIO : 0);
    }
  }
}

void UsbPort::end_transmission() {
  if (!transmission_) return;
  const bool whole = !transmission_->cut && transmission_->sent == transmission_->bytes->size();
  ++(whole ? counters_.delivered : counters_.cut);
  transmission_.reset();
  event_.notify_all();
}

void UsbPort::finish_first(int status) {
  UsbTransfer transfer = std::move(waiting_.front());
  waiting_.pop_front();
  const bool short_of = transfer.actual < transfer.length;
  const UsbClient client = transfer.client;
  finish(std::move(transfer), status);
  // The rest of what the driver had split.
  while (short_of && !waiting_.empty() && waiting_.front().continues && waiting_.front().client == client) {
    UsbTransfer rest = std::move(waiting_.front());
    waiting_.pop_front();
    finish(std::move(rest), -ECONNRESET);
  }
}

void UsbPort::finish(UsbTransfer transfer, int status) {
  transfer.status = status;
  done_[transfer.client].push_back(std::move(transfer));
  ready_.set(true);
}

void UsbPort::finish_all(int status) {
  for (UsbTransfer& transfer : waiting_) finish(std::move(transfer), status);
  waiting_.clear();
  if (status == -EPIPE) return;  // of the frames' endpoint alone
  for (UsbTransfer& transfer : unanswered_) finish(std::move(transfer), status);
  unanswered_.clear();
}

}  // namespace relmap::testing
