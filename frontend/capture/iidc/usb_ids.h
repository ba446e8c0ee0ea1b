// USB devices that are IIDC cameras. Nothing in a descriptor says so; cameras are recognised by vendor and product.
#pragma once

#include <array>
#include <cstdint>

namespace relmap::iidc {

inline constexpr std::uint16_t kPointGrey = 0x1e10;
inline constexpr std::array<std::uint16_t, 15> kPointGreyProducts = {
    0x2000, 0x2001, 0x2002, 0x2003,                          // Firefly MV, colour and grey
    0x2004, 0x2005,                                          // Chameleon, colour and grey
    0x3000, 0x3005, 0x3006, 0x3008, 0x300a, 0x300b, 0x3300,  // Flea 3
    0x3103,                                                  // Grasshopper 3
    0x3800,                                                  // Ladybug 5
};

}  // namespace relmap::iidc
