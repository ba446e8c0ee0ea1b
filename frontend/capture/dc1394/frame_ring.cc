#include "frontend/capture/dc1394/frame_ring.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace relmap::iidc::dc1394 {

namespace {

constexpr std::size_t kPage = 4096;
constexpr std::size_t kHeader = kPage;  // whether a slot is taken, 4 bytes each

static_assert(FrameRing::kMaxSlots * sizeof(std::uint32_t) <= kHeader);
static_assert(std::atomic_ref<std::uint32_t>::is_always_lock_free);

std::size_t stride_of(std::size_t frame_bytes) { return (frame_bytes + kPage - 1) / kPage * kPage; }

Status check(std::size_t slots, std::size_t frame_bytes) {
  if (slots >= 1 && slots <= FrameRing::kMaxSlots && frame_bytes >= 1 && frame_bytes <= FrameRing::kMaxBytes / slots)
    return {};
  return {Reason::INVALID_ARGUMENT, std::to_string(slots) + " frames of " + std::to_string(frame_bytes) + " bytes"};
}

std::uint8_t* map_file(int file, std::size_t size) {
  void* const memory = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  return memory == MAP_FAILED ? nullptr : static_cast<std::uint8_t*>(memory);
}

}  // namespace

FrameRing::FrameRing(FileHandle file, std::uint8_t* memory, std::size_t slots, std::size_t frame_bytes)
    : file_(std::move(file)),
      memory_(memory),
      frames_(memory + kHeader),
      slots_(slots),
      frame_bytes_(frame_bytes),
      stride_(stride_of(frame_bytes)),
      is_lent_(new std::atomic<bool>[slots]()) {}

FrameRing::~FrameRing() { ::munmap(memory_, kHeader + slots_ * stride_); }

Result<std::shared_ptr<FrameRing>> FrameRing::make(std::size_t slots, std::size_t frame_bytes) {
  if (Status status = check(slots, frame_bytes); !status.ok()) return status;
  const std::size_t size = kHeader + slots * stride_of(frame_bytes);
  FileHandle file(::memfd_create("relmap-frames", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  int error = file ? 0 : errno;
  if (error == 0) error = ::posix_fallocate(file.get(), 0, static_cast<off_t>(size));  // else a write may be SIGBUS
  if (error == 0 && ::fcntl(file.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL) != 0) error = errno;
  std::uint8_t* const memory = error == 0 ? map_file(file.get(), size) : nullptr;
  if (error == 0 && !memory) error = errno;
  if (error != 0)
    return {Reason::BUDGET_EXCEEDED, "no memory for " + std::to_string(slots) + " frames of " +
                                         std::to_string(frame_bytes) + " bytes: " + std::strerror(error)};
  return std::shared_ptr<FrameRing>(new FrameRing(std::move(file), memory, slots, frame_bytes));
}

Result<std::shared_ptr<FrameRing>> FrameRing::map(FileHandle file, std::size_t slots, std::size_t frame_bytes) {
  if (Status status = check(slots, frame_bytes); !status.ok()) return status;
  const std::size_t size = kHeader + slots * stride_of(frame_bytes);
  struct stat about {};
  if (!file || ::fstat(file.get(), &about) != 0 || about.st_size != static_cast<off_t>(size))
    return {Reason::INVALID_ARGUMENT, "no memory of " + std::to_string(size) + " bytes came with it"};
  std::uint8_t* const memory = map_file(file.get(), size);
  if (!memory) return {Reason::BUDGET_EXCEEDED, std::string("frames cannot be mapped: ") + std::strerror(errno)};
  return std::shared_ptr<FrameRing>(new FrameRing(std::move(file), memory, slots, frame_bytes));
}

std::atomic_ref<std::uint32_t> FrameRing::taken(std::uint32_t slot) {
  return std::atomic_ref<std::uint32_t>(reinterpret_cast<std::uint32_t*>(memory_)[slot]);
}

std::optional<std::uint32_t> FrameRing::take() {
  for (std::size_t i = 0; i < slots_; ++i) {
    const std::uint32_t slot = next_;
    next_ = static_cast<std::uint32_t>((next_ + 1) % slots_);
    if (taken(slot).exchange(1, std::memory_order_acquire) == 0) return slot;
  }
  return std::nullopt;
}

void FrameRing::give_back(std::uint32_t slot) { taken(slot).store(0, std::memory_order_release); }

std::shared_ptr<const std::uint8_t> FrameRing::lend(std::uint32_t slot) {
  if (slot >= slots_ || is_lent_[slot].exchange(true)) return nullptr;
  ++lent_;
  return {frames_ + slot * stride_, [ring = shared_from_this(), slot](const std::uint8_t*) {
            ring->is_lent_[slot] = false;
            --ring->lent_;
            ring->give_back(slot);
          }};
}

}  // namespace relmap::iidc::dc1394
