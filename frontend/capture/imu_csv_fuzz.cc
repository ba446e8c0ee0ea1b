// Any text as an inertial recording: what is read is finite and by rising time.
#include <cstdint>
#include <cstdlib>

#include "frontend/capture/imu_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto samples = relmap::capture::parse_imu_csv({reinterpret_cast<const char*>(data), size});
  if (!samples.ok()) return 0;
  if (samples->empty()) std::abort();
  for (std::size_t i = 0; i < samples->size(); ++i) {
    const relmap::ImuSample& sample = (*samples)[i];
    if (!sample.gyro.allFinite() || !sample.acceleration.allFinite()) std::abort();
    if (sample.time_us < 0 || (i > 0 && sample.time_us <= (*samples)[i - 1].time_us)) std::abort();
  }
  return 0;
}
