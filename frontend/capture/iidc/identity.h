// Identifies cameras and finds them on several buses.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frontend/capture/iidc/camera_link.h"
#include "frontend/capture/iidc/config_rom.h"
#include "proto/base/status.h"

namespace relmap::iidc {

// Reads the ROM of a camera and sets GUID, serial number and names of `address`. If the ROM cannot be read, sets
// `usable` to the cause and returns nothing.
std::optional<ConfigRom> identify(CameraLink& link, CameraAddress& address);

struct FoundCamera {
  CameraAddress address;
  std::shared_ptr<CameraBus> bus;
};

// Lists the cameras of all buses, each camera once, with the first bus on which it is usable. Errors of buses are added
// to `troubles`, if that is not null.
std::vector<FoundCamera> find_cameras(const std::vector<std::shared_ptr<CameraBus>>& buses,
                                      std::vector<Status>* troubles = nullptr);

// The camera of that serial number or GUID; an empty `serial` means the only one. NO_CAMERA, with a list of those that
// exist; INVALID_ARGUMENT if there are several; the camera's own reason if it is not usable.
Result<FoundCamera> choose_camera(const std::vector<std::shared_ptr<CameraBus>>& buses, const std::string& serial);

// Opens a camera again by its GUID, on whatever bus and port it is now. NO_CAMERA while it is absent.
Result<std::unique_ptr<CameraLink>> reopen(const std::vector<std::shared_ptr<CameraBus>>& buses, std::uint64_t guid);

std::string guid_text(std::uint64_t guid);  // 16 hexadecimal digits

}  // namespace relmap::iidc
