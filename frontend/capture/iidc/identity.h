// Who a camera is.
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

// GUID, serial number and names into `address`, by its ROM; where that cannot be read, why, into `usable`. Nothing
// then.
std::optional<ConfigRom> identify(CameraLink& link, CameraAddress& address);

struct FoundCamera {
  CameraAddress address;
  std::shared_ptr<CameraBus> bus;
};

// Of all buses, each camera once: the first bus that it can be used by serves it. What a bus cannot say goes to
// `troubles`, if that is not null.
std::vector<FoundCamera> find_cameras(const std::vector<std::shared_ptr<CameraBus>>& buses,
                                      std::vector<Status>* troubles = nullptr);

// The one of that serial number or GUID; empty: the only one. NO_CAMERA, with those that there are; INVALID_ARGUMENT:
// there are several; why it cannot be used, where it is there but cannot.
Result<FoundCamera> choose_camera(const std::vector<std::shared_ptr<CameraBus>>& buses, const std::string& serial);

// Once more, by its GUID, wherever it hangs now: NO_CAMERA while it is away.
Result<std::unique_ptr<CameraLink>> reopen(const std::vector<std::shared_ptr<CameraBus>>& buses, std::uint64_t guid);

std::string guid_text(std::uint64_t guid);  // 16 hexadecimal digits

}  // namespace relmap::iidc
