// The registers of one camera by their offsets, and writes that are read back.
#pragma once

#include <cstdint>
#include <string>

#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/status.h"

namespace relmap::iidc {

class RegisterFile {
 public:
  // `base`: ConfigRom::command_registers. The link must outlive it.
  RegisterFile(CameraLink& link, std::uint64_t base) : link_(&link), base_(base) {}

  Result<std::uint32_t> read(std::uint32_t offset) const;
  Status write(std::uint32_t offset, std::uint32_t value) const;

  // What `mask` covers must be read again as it was written. REGISTER_REFUSED, by the register's `name` in the
  // specification.
  Status write_kept(std::uint32_t offset, std::uint32_t value, std::uint32_t mask, const std::string& name) const;

  // Of another register space of the camera: at the offset that `pointer` (an inquiry register, in quadlets from
  // kRegisterSpace) tells. UNSUPPORTED: it points nowhere.
  Result<RegisterFile> at(std::uint32_t pointer) const;

  CameraLink& link() const { return *link_; }

 private:
  CameraLink* link_;
  std::uint64_t base_;
};

}  // namespace relmap::iidc
