#include "frontend/capture/iidc/embedded_info.h"

#include "frontend/capture/iidc/cycle_clock.h"
#include "frontend/capture/iidc/registers.h"
#include "proto/base/big_endian.h"

namespace relmap::iidc {

namespace {

constexpr std::uint32_t kMaxLost = 1'000'000;  // counters ahead: hours

}  // namespace

Result<bool> embed_info(const RegisterFile& registers) {
  const auto there = registers.read(pgr::kFrameInfo);
  if (there.reason() == Reason::IO_ERROR) return false;
  if (!there.ok()) return there.status();
  constexpr std::uint32_t kAll = 0x3ff, kWanted = pgr::kStamp | pgr::kFrameCounter;
  if (!(*there & kOn)) return false;
  const Status kept = registers.write_kept(pgr::kFrameInfo, kOn | kWanted, kAll, "FRAME_INFO");
  if (kept.reason() == Reason::REGISTER_REFUSED) return false;
  if (!kept.ok()) return kept;
  return true;
}

std::optional<EmbeddedInfo> embedded_info(std::span<const std::uint8_t> frame) {
  if (frame.size() < 8) return std::nullopt;
  const EmbeddedInfo info{big_endian(frame.first(4)), big_endian(frame.subspan(4, 4))};
  if (!is_cycle_time(info.cycle)) return std::nullopt;
  return info;
}

bool follows(std::uint32_t counter, std::uint32_t last) {
  const std::uint32_t ahead = counter - last;
  return ahead > 0 && ahead < kMaxLost;
}

}  // namespace relmap::iidc
