// Any text as an inertial recording: what is read is finite and by rising time.
#include "frontend/capture/imu_csv.h"
#include "proto/base/testing/fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using fuzzing::must;
  const auto samples = capture::parse_imu_csv(fuzzing::text_of({data, size}));
  if (!samples.ok()) return 0;
  must(!samples->empty());
  for (std::size_t i = 0; i < samples->size(); ++i) {
    const ImuSample& sample = (*samples)[i];
    must(sample.gyro.allFinite() && sample.acceleration.allFinite() && sample.time_us >= 0);
    must(i == 0 || sample.time_us > (*samples)[i - 1].time_us);
  }
  return 0;
}
