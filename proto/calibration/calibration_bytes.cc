#include "proto/calibration/calibration_bytes.h"

namespace relmap {

namespace {

// Visits the fields in their order in the bytes, for the writer and for the reader; matrices column by column.
template <typename Calibration, typename Field>
void each_field(Calibration& c, Field field) {
  for (auto* camera : {&c.left, &c.right})
    for (auto* number : {&camera->fx, &camera->fy, &camera->cx, &camera->cy, &camera->k1, &camera->k2, &camera->p1,
                         &camera->p2, &camera->k3})
      field(number, 1);
  for (auto* T : {&c.T_right_left, &c.T_body_left}) {
    field(T->R.data(), 9);
    field(T->t.data(), 3);
  }
}

}  // namespace

Bytes encode_calibration(const StereoCalibration& calibration) {
  ByteWriter out;
  out.put(static_cast<std::int32_t>(calibration.width));
  out.put(static_cast<std::int32_t>(calibration.height));
  out.put(static_cast<std::uint8_t>(calibration.rectified));
  each_field(calibration, [&](const double* numbers, std::size_t count) { out.put_array(numbers, count); });
  return out.take();
}

Result<StereoCalibration> decode_calibration(ByteSpan bytes) {
  ByteReader in(bytes);
  StereoCalibration calibration;
  calibration.width = in.get<std::int32_t>();
  calibration.height = in.get<std::int32_t>();
  const auto rectified = in.get<std::uint8_t>();
  calibration.rectified = rectified == 1;
  each_field(calibration, [&](double* numbers, std::size_t count) { in.get_array(numbers, count); });
  if (!in.at_end())
    return {Reason::CORRUPT, "a calibration of " + std::to_string(bytes.size()) + " bytes is too short or too long"};
  if (rectified > 1)
    return {Reason::CORRUPT, "the flag for rectified pictures is " + std::to_string(rectified) + "; must be 0 or 1"};
  return calibration;
}

}  // namespace relmap
