#include <cmath>
#include <limits>
#include <string>

#include "proto/wire/convert.h"

namespace relmap {

v1::FeatureSet to_wire(std::span<const AppearanceFeature> features) {
  v1::FeatureSet wire;
  for (const AppearanceFeature& f : features) {
    v1::Feature& out = *wire.add_features();
    out.set_u(f.u);
    out.set_v(f.v);
    if (!std::isnan(f.disparity)) out.set_disparity(f.disparity);
    out.set_scale(f.scale);
    out.set_angle(f.angle);
    out.set_sift(f.descriptor.data(), f.descriptor.size());
  }
  return wire;
}

Result<std::vector<AppearanceFeature>> from_wire(const v1::FeatureSet& set) {
  if (set.features_size() > static_cast<int>(kMaxAppearance))
    return {Reason::BAD_SIZE,
            std::to_string(set.features_size()) + " features; at most " + std::to_string(kMaxAppearance)};
  std::vector<AppearanceFeature> features;
  features.reserve(static_cast<std::size_t>(set.features_size()));
  for (const v1::Feature& in : set.features()) {
    AppearanceFeature f;
    f.u = in.u();
    f.v = in.v();
    f.disparity = in.has_disparity() ? in.disparity() : std::numeric_limits<float>::quiet_NaN();
    f.scale = in.scale();
    f.angle = in.angle();
    for (const float value : {f.u, f.v, f.scale, f.angle, in.has_disparity() ? f.disparity : 0})
      if (!std::isfinite(value)) return {Reason::NOT_FINITE, "a feature is not finite"};
    if (in.sift().size() != f.descriptor.size())
      return {Reason::BAD_SIZE, "descriptor of " + std::to_string(in.sift().size()) + " bytes; must be 128"};
    std::copy(in.sift().begin(), in.sift().end(), f.descriptor.begin());
    features.push_back(f);
  }
  return features;
}

}  // namespace relmap
