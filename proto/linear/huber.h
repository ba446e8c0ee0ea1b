// Huber's loss, by which least squares bears outliers (Huber, Robust Statistics, 1981).
#pragma once

namespace relmap {

// The loss of a whitened residual's norm e >= 0 with the corner at k >= 0, both in standard deviations: e^2 up to the
// corner, 2 k e - k^2 above it; with an infinite corner e^2 everywhere.
inline double huber_loss(double e, double k) { return e <= k ? e * e : 2 * k * e - k * k; }
// By how much a residual counts beside one below the corner, 0..1: the loss's derivative divided by 2 e.
inline double huber_weight(double e, double k) { return e <= k ? 1 : k / e; }

}  // namespace relmap
