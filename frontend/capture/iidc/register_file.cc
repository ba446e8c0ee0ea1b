#include "frontend/capture/iidc/register_file.h"

#include <cstdio>

#include "frontend/capture/iidc/registers.h"

namespace relmap::iidc {

namespace {

std::string register_text(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "%03Xh", value);
  return text;
}

}  // namespace

Result<std::uint32_t> RegisterFile::read(std::uint32_t offset) const {
  std::uint32_t value = 0;
  if (Status status = link_->read(base_ + offset, {&value, 1}); !status.ok()) return status;
  return value;
}

Status RegisterFile::write(std::uint32_t offset, std::uint32_t value) const {
  return link_->write(base_ + offset, value);
}

Status RegisterFile::write_kept(std::uint32_t offset, std::uint32_t value, std::uint32_t mask,
                                const std::string& name) const {
  if (Status status = write(offset, value); !status.ok()) return status;
  const auto kept = read(offset);
  if (!kept.ok()) return kept.status();
  if (((*kept ^ value) & mask) == 0) return {};
  return {Reason::REGISTER_REFUSED, name + " (register " + register_text(offset) + ") holds " +
                                        register_text(*kept & mask) + " after " + register_text(value & mask) +
                                        " was written"};
}

Result<RegisterFile> RegisterFile::at(std::uint32_t pointer) const {
  const auto quadlets = read(pointer);
  if (!quadlets.ok()) return quadlets.status();
  if (*quadlets == 0 || *quadlets == 0xffff'ffff)
    return {Reason::UNSUPPORTED, "register " + register_text(pointer) + " points nowhere"};
  return RegisterFile(*link_, kRegisterSpace + 4 * std::uint64_t{*quadlets});
}

}  // namespace relmap::iidc
