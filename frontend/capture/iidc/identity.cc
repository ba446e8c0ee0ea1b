#include "frontend/capture/iidc/identity.h"

#include <algorithm>

#include "frontend/capture/iidc/register_file.h"
#include "frontend/capture/iidc/registers.h"
#include "proto/base/hex.h"

namespace relmap::iidc {

namespace {

std::string described(const CameraAddress& address) {
  return address.model + " " + (address.serial.empty() ? "of unknown number" : address.serial) + " (" + address.bus +
         ", " + address.place + ")";
}

}  // namespace

std::string guid_text(std::uint64_t guid) { return hex(guid); }

std::optional<ConfigRom> identify(CameraLink& link, CameraAddress& address) {
  const auto quadlets = read_config_rom(link);
  auto rom = quadlets.ok() ? parse_config_rom(*quadlets) : Result<ConfigRom>(quadlets.status());
  if (!rom.ok()) {
    address.usable = rom.status();
    return std::nullopt;
  }
  address.guid = rom->guid;
  address.vendor = rom->vendor;
  address.model = rom->model;
  address.serial = guid_text(rom->guid);
  if (rom->vendor_id == pgr::kVendor)
    if (const auto number = RegisterFile(link, rom->command_registers).read(pgr::kSerialNumber);
        number.ok() && *number != 0)
      address.serial = std::to_string(*number);
  return *std::move(rom);
}

std::vector<FoundCamera> find_cameras(const std::vector<std::shared_ptr<CameraBus>>& buses,
                                      std::vector<Status>* troubles) {
  std::vector<FoundCamera> found;
  for (const auto& bus : buses) {
    const auto there = bus->cameras();
    if (!there.ok()) {
      if (troubles) troubles->push_back({there.reason(), bus->name() + ": " + there.status().message()});
      continue;
    }
    for (const CameraAddress& address : *there) {
      const auto known = std::find_if(found.begin(), found.end(), [&](const FoundCamera& other) {
        return address.guid != 0 && other.address.guid == address.guid;
      });
      if (known == found.end())
        found.push_back({address, bus});
      else if (!known->address.usable.ok() && address.usable.ok())
        *known = {address, bus};
    }
  }
  return found;
}

Result<FoundCamera> choose_camera(const std::vector<std::shared_ptr<CameraBus>>& buses, const std::string& serial) {
  std::vector<Status> troubles;
  const std::vector<FoundCamera> found = find_cameras(buses, &troubles);
  std::string there;
  const FoundCamera* chosen = nullptr;
  for (const FoundCamera& camera : found) {
    there += (there.empty() ? "" : ", ") + described(camera.address);
    if (serial.empty() || camera.address.serial == serial ||
        (camera.address.guid != 0 && guid_text(camera.address.guid) == serial))
      chosen = &camera;
  }
  if (serial.empty() && found.size() > 1)
    return {Reason::INVALID_ARGUMENT, "there are several cameras: " + there + "; say which by its serial number"};
  if (chosen && !chosen->address.usable.ok())
    return {chosen->address.usable.reason(), described(chosen->address) + ": " + chosen->address.usable.message()};
  if (chosen) return *chosen;
  // A camera whose number cannot be read may be the one.
  for (const FoundCamera& camera : found)
    if (camera.address.guid == 0)
      return {camera.address.usable.reason(), described(camera.address) + ": " + camera.address.usable.message()};
  std::string why = serial.empty() ? "no IIDC camera" : "no camera " + serial;
  if (!there.empty()) why += "; there is " + there;
  for (const Status& trouble : troubles) why += "; " + trouble.message();
  return {Reason::NO_CAMERA, why};
}

Result<std::unique_ptr<CameraLink>> reopen(const std::vector<std::shared_ptr<CameraBus>>& buses, std::uint64_t guid) {
  Status last(Reason::NO_CAMERA, "the camera is away");
  for (const auto& bus : buses) {
    auto link = bus->open(guid);
    if (link.ok()) return link;
    if (link.reason() != Reason::NO_CAMERA && link.reason() != Reason::UNSUPPORTED) last = link.status();
  }
  return last;
}

}  // namespace relmap::iidc
