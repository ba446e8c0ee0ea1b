// Addresses and bits of IIDC cameras, from: 1394 Trade Association, "IIDC 1394-based Digital Camera
// Specification", 1.31 and 1.32. The titles of its sections are above their registers (section numbers differ between
// versions). Configuration ROM and cycle time are from IEEE 1212 and 1394. Bit 0 of the specification is the most
// significant bit of a quadlet.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>

namespace relmap::iidc {

inline constexpr std::uint64_t kRegisterSpace = 0xffff'f000'0000;    // IEEE 1394: initial register space of a node
inline constexpr std::uint64_t kCycleTime = kRegisterSpace + 0x200;  // IEEE 1394, 8.3.2.3.1
inline constexpr std::uint64_t kConfigRom = kRegisterSpace + 0x400;  // IEEE 1212
inline constexpr std::uint32_t kIidcSpecifier = 0x00a02d;            // unit_spec_ID, "Configuration ROM"
inline constexpr std::uint32_t kIidcVersionFirst = 0x000100;  // unit_sw_version of 1.04; 0x101: 1.20, 0x102: 1.30

// An address as messages name it: "FFFFF0F00830h".
inline std::string address_text(std::uint64_t address) {
  char text[24];
  std::snprintf(text, sizeof text, "%012llXh", static_cast<unsigned long long>(address));
  return text;
}

// Offsets from the base of the command registers, which is in the ROM [1.4 to 1.8].
namespace reg {
// "Camera initialize register".
inline constexpr std::uint32_t kInitialize = 0x000;  // INITIALIZE: bit 0 resets to factory settings
// "Inquiry register for video format", "... for video mode", "... for video frame rate and base address of the video
// mode CSR for the scalable image size format".
inline constexpr std::uint32_t kFormatInq = 0x100;      // V_FORMAT_INQ
inline constexpr std::uint32_t kModeInq = 0x180;        // V_MODE_INQ_0 .. 7: 4 bytes a format
inline constexpr std::uint32_t kRateInq = 0x200;        // V_RATE_INQ_0_0 .. 2_7: 0x20 a format, 4 a mode
inline constexpr std::uint32_t kFormat7CsrInq = 0x2e0;  // V_CSR_INQ_7_0 .. 7: offset in quadlets, 4 a mode
// "Inquiry register for basic function".
inline constexpr std::uint32_t kBasicFuncInq = 0x400;  // BASIC_FUNC_INQ: bit 16 CAMERA_POWER
// "Inquiry register for feature presence".
inline constexpr std::uint32_t kFeatureHiInq = 0x404;    // FEATURE_HI_INQ: bits 0 .. 15
inline constexpr std::uint32_t kFeatureLoInq = 0x408;    // FEATURE_LO_INQ
inline constexpr std::uint32_t kOptFunctionInq = 0x40c;  // OPT_FUNCTION_INQ: bit 1 PIO, 2 SIO, 3 strobe
inline constexpr std::uint32_t kAdvFeatureInq = 0x480;   // ADVANCED_FEATURE_INQ: offset in quadlets
inline constexpr std::uint32_t kStrobeCsrInq = 0x48c;    // STROBE_OUTPUT_CSR_INQ: offset in quadlets
// "Inquiry register for feature elements".
inline constexpr std::uint32_t kElementInq = 0x500;     // BRIGHTNESS_INQ ..., of FEATURE_HI's
inline constexpr std::uint32_t kElementInqLow = 0x580;  // ZOOM_INQ ..., of FEATURE_LO's
// "Inquiry register for absolute value CSR offset address".
inline constexpr std::uint32_t kAbsoluteCsrInq = 0x700;     // ABS_CSR_HI_INQ_0 ...: offset in quadlets
inline constexpr std::uint32_t kAbsoluteCsrInqLow = 0x780;  // ABS_CSR_LO_INQ_0 ...
// "Status and control register for camera".
inline constexpr std::uint32_t kCurrentRate = 0x600;      // CUR_V_FRM_RATE, bits 0 .. 2
inline constexpr std::uint32_t kCurrentMode = 0x604;      // CUR_V_MODE, bits 0 .. 2
inline constexpr std::uint32_t kCurrentFormat = 0x608;    // CUR_V_FORMAT, bits 0 .. 2
inline constexpr std::uint32_t kIsoChannel = 0x60c;       // ISO_CHANNEL and ISO_SPEED
inline constexpr std::uint32_t kCameraPower = 0x610;      // CAMERA_POWER, bit 0
inline constexpr std::uint32_t kIsoEnable = 0x614;        // ISO_EN / CONTINUOUS_SHOT, bit 0
inline constexpr std::uint32_t kOneShot = 0x61c;          // ONE_SHOT, MULTI_SHOT
inline constexpr std::uint32_t kSoftwareTrigger = 0x62c;  // SOFTWARE_TRIGGER, bit 0
inline constexpr std::uint32_t kDataDepth = 0x630;        // DATA_DEPTH, bits 0 .. 7
// "Status and control register for feature".
inline constexpr std::uint32_t kFeature = 0x800;     // BRIGHTNESS ..., of FEATURE_HI's
inline constexpr std::uint32_t kFeatureLow = 0x880;  // ZOOM ..., of FEATURE_LO's
}  // namespace reg

inline constexpr std::uint32_t kOn = 0x8000'0000;  // bit 0

// "Inquiry register for feature elements".
namespace inquiry {
inline constexpr std::uint32_t kPresent = 0x8000'0000, kAbsolute = 0x4000'0000, kOnePush = 0x1000'0000,
                               kReadOut = 0x0800'0000, kOnOff = 0x0400'0000, kAuto = 0x0200'0000, kManual = 0x0100'0000;
inline constexpr int kMinShift = 12;  // 12 bits each: minimum and maximum
}  // namespace inquiry

// "Status and control register for feature".
namespace control {
inline constexpr std::uint32_t kPresent = 0x8000'0000, kAbsolute = 0x4000'0000, kOnePush = 0x0400'0000,
                               kOn = 0x0200'0000, kAuto = 0x0100'0000, kValue = 0x0000'0fff;
inline constexpr std::uint32_t kPolarity = 0x0100'0000;   // of TRIGGER_MODE: 1 active high
inline constexpr int kSourceShift = 21, kModeShift = 16;  // of TRIGGER_MODE: 3 and 4 bits
}  // namespace control

// "Absolute value CSR register": IEEE 754 single precision.
namespace absolute {
inline constexpr std::uint32_t kMin = 0x0, kMax = 0x4, kValue = 0x8;
}

// "Strobe signal output": of STROBE_OUTPUT_CSR_INQ's registers, 4 bytes a pin.
namespace strobe {
inline constexpr std::uint32_t kPresence = 0x000;  // STROBE_CTR_INQ: a bit a pin
inline constexpr std::uint32_t kControl = 0x200;   // STROBE_0_CNT ...: on, polarity, delay and duration of 12 bits
}  // namespace strobe

// "Video mode control and status registers for Format_7".
namespace format7 {
inline constexpr std::uint32_t kMaxImageSize = 0x000;     // MAX_IMAGE_SIZE_INQ: width, height, 16 bits each
inline constexpr std::uint32_t kUnitSize = 0x004;         // UNIT_SIZE_INQ
inline constexpr std::uint32_t kPosition = 0x008;         // IMAGE_POSITION: left, top
inline constexpr std::uint32_t kSize = 0x00c;             // IMAGE_SIZE
inline constexpr std::uint32_t kColorCoding = 0x010;      // COLOR_CODING_ID, bits 0 .. 7
inline constexpr std::uint32_t kColorCodingInq = 0x014;   // COLOR_CODING_INQ: bit per coding
inline constexpr std::uint32_t kPixelNumber = 0x034;      // PIXEL_NUMBER_INQ
inline constexpr std::uint32_t kTotalBytesHi = 0x038;     // TOTAL_BYTES_HI_INQ
inline constexpr std::uint32_t kTotalBytesLo = 0x03c;     // TOTAL_BYTES_LO_INQ
inline constexpr std::uint32_t kPacketPara = 0x040;       // PACKET_PARA_INQ: unit and maximum bytes of a packet
inline constexpr std::uint32_t kBytesPerPacket = 0x044;   // BYTE_PER_PACKET: in use, recommended
inline constexpr std::uint32_t kPacketsPerFrame = 0x048;  // PACKET_PER_FRAME_INQ
inline constexpr std::uint32_t kUnitPosition = 0x04c;     // UNIT_POSITION_INQ
inline constexpr std::uint32_t kFrameInterval = 0x050;    // FRAME_INTERVAL_INQ: seconds, IEEE 754
inline constexpr std::uint32_t kColorFilter = 0x058;      // COLOR_FILTER_ID, bits 0 .. 7: RGGB, GBRG, GRBG, BGGR
inline constexpr std::uint32_t kValueSetting = 0x07c;     // VALUE_SETTING
namespace setting {
inline constexpr std::uint32_t kPresent = 0x8000'0000, kSetting1 = 0x4000'0000, kError1 = 0x0080'0000,
                               kError2 = 0x0040'0000;
}
}  // namespace format7

// Point Grey Research, "Digital Camera Register Reference": of its cameras alone (vendor 0x00b09d).
namespace pgr {
inline constexpr std::uint32_t kVendor = 0x00b09d;
inline constexpr std::uint32_t kFrameInfo = 0x12f8;     // FRAME_INFO: presence, and what is embedded in a frame
inline constexpr std::uint32_t kSerialNumber = 0x1f20;  // SERIAL_NUMBER
inline constexpr std::uint32_t kBayerTile = 0x1040;     // BAYER_TILE_MAPPING: four letters; "YYYY" grey
inline constexpr std::uint32_t kDataFormat = 0x1048;    // IMAGE_DATA_FORMAT: bit 31 byte order of Y16
inline constexpr std::uint32_t kCycleTime = 0x1ea8;     // CURRENT_CPU_TIME / cycle time, where there is no 1394 bus
// Bits of FRAME_INFO: what stands in the first bytes of a frame, four bytes each, in this order.
inline constexpr std::uint32_t kStamp = 0x001, kGain = 0x002, kShutter = 0x004, kBrightness = 0x008, kExposure = 0x010,
                               kWhiteBalance = 0x020, kFrameCounter = 0x040, kStrobe = 0x080, kGpio = 0x100,
                               kRoi = 0x200;
}  // namespace pgr

}  // namespace relmap::iidc
