#include "storage/io/disk_space.h"

#include <algorithm>

#include "proto/base/mutex.h"

namespace relmap::storage {
namespace {

using Clock = std::chrono::steady_clock;

std::string megabytes(std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

}  // namespace

DiskSpace::DiskSpace(std::shared_ptr<FileSystem> files, std::string folder, DiskSpaceOptions options)
    : files_(std::move(files)), folder_(std::move(folder)), reserve_path_(folder_ + "/RESERVE"), options_(options) {
  if (const auto room = files_->room(folder_); room.ok()) {
    options_.low_water = std::min(options_.low_water, room->size / 16);
    options_.reserve = std::min(options_.reserve, options_.low_water / 4);
  }
  // After a power failure the file may be there without the room.
  const auto reserve = files_->open_read(reserve_path_);
  reserved_ = reserve.ok() && (*reserve)->size() >= options_.reserve;
  look(Clock::now());
}

// Asks the file system how much is free. If it does not answer, the disk is not taken to be full: writes will show.
void DiskSpace::look(Clock::time_point now) {
  look_at_ = now + options_.ask_every;
  const auto room = files_->room(folder_);
  if (!room.ok()) return;
  room_ = *room;
  const std::uint64_t ample = options_.low_water + options_.low_water / 4;
  if (!reserved_ && room_.free >= ample + options_.reserve)
    reserved_ = files_->occupy(reserve_path_, options_.reserve).ok();
  if (room_.free < options_.low_water) full_ = true;
  if (room_.free >= ample && reserved_) full_ = false;
}

Status DiskSpace::check() {
  const MutexLock lock(mutex_);
  if (const auto now = Clock::now(); now >= look_at_) look(now);
  if (!full_) return {};
  return {Reason::DISK_FULL, folder_ + ": " + megabytes(room_.free) + " of " + megabytes(room_.size) +
                                 " free; nothing is taken in below " + megabytes(options_.low_water)};
}

Status DiskSpace::spare(std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  const auto room = files_->room(folder_);
  if (!room.ok() || room->free >= bytes) return {};
  return {Reason::DISK_FULL, folder_ + ": " + megabytes(room->free) + " of " + megabytes(room->size) + " free, " +
                                 megabytes(bytes) + " needed for a commit"};
}

void DiskSpace::note_failure() {
  const MutexLock lock(mutex_);
  if (const auto room = files_->room(folder_); room.ok()) room_ = *room;
  full_ = true;
  look_at_ = Clock::now() + options_.believe_failure;
}

bool DiskSpace::give_up_reserve() {
  note_failure();
  const MutexLock lock(mutex_);
  if (!reserved_ || !files_->remove(reserve_path_).ok()) return false;
  reserved_ = false;
  return true;
}

}  // namespace relmap::storage
