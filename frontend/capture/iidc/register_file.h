// Reads and writes the registers of one camera by their offsets, and verifies writes by reading back.
#pragma once

#include <cstdint>
#include <string>

#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/status.h"

namespace relmap::iidc {

class RegisterFile {
 public:
  // `base` is ConfigRom::command_registers. The link must outlive this object.
  RegisterFile(CameraLink& link, std::uint64_t base) : link_(&link), base_(base) {}

  Result<std::uint32_t> read(std::uint32_t offset) const;
  Status write(std::uint32_t offset, std::uint32_t value) const;

  // Writes a register and reads it back. REGISTER_REFUSED if the bits of `mask` differ; the message has the register's
  // `name` in the specification.
  Status write_kept(std::uint32_t offset, std::uint32_t value, std::uint32_t mask, const std::string& name) const;

  // Another register space of the camera, at the offset in `pointer` (an inquiry register that has quadlets from
  // kRegisterSpace). UNSUPPORTED if the pointer is invalid.
  Result<RegisterFile> at(std::uint32_t pointer) const;

  CameraLink& link() const { return *link_; }

 private:
  CameraLink* link_;
  std::uint64_t base_;
};

}  // namespace relmap::iidc
