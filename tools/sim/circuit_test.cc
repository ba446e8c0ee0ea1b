#include "tools/sim/circuit.h"

#include <gtest/gtest.h>

namespace relmap::sim {
namespace {

TEST(Circuit, ClosesSmoothlyAndIsAsLongAsAsked) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Circuit circuit(seed, 80);
    EXPECT_NEAR((circuit.point(80) - circuit.point(0)).norm(), 0, 1e-9);
    EXPECT_NEAR((circuit.direction(79.999) - circuit.direction(0.001)).norm(), 0, 1e-3);
    EXPECT_NEAR((circuit.point(-3) - circuit.point(77)).norm(), 0, 1e-9);
    double length = 0;
    for (int k = 0; k < 4000; ++k) length += (circuit.point((k + 1) * 0.02) - circuit.point(k * 0.02)).norm();
    EXPECT_NEAR(length, 80, 0.01);
    EXPECT_GT(circuit.min_radius(), 3);
  }
}

TEST(Circuit, PositionsAreSpacedByArcLength) {
  const Circuit circuit(3, 100);
  for (double s = 0; s < 100; s += 0.37) {
    const Vector2 step = circuit.point(s + 0.1) - circuit.point(s);
    EXPECT_NEAR(step.norm(), 0.1, 1e-4);
    EXPECT_NEAR(step.normalized().dot(circuit.direction(s + 0.05)), 1, 1e-4);
  }
}

TEST(Circuit, BesideIsToTheRightOfTheDriver) {
  // A driver who looks along z has x on the right.
  const Circuit circuit(4, 60);
  const Vector2 forward = circuit.direction(10), right = circuit.beside(10, 1) - circuit.point(10);
  EXPECT_NEAR(right.norm(), 1, 1e-9);
  EXPECT_NEAR(right.x() * forward.y() - right.y() * forward.x(), 1, 1e-9);
  // What is beside it on the inner side lies nearer to the middle.
  const Vector2 inside = circuit.beside(10, 2 * circuit.inner_side());
  EXPECT_LT(inside.norm(), circuit.point(10).norm());
}

TEST(Circuit, SeedsGiveOtherShapes) { EXPECT_GT((Circuit(1, 100).point(50) - Circuit(2, 100).point(50)).norm(), 0.5); }

}  // namespace
}  // namespace relmap::sim
