#include "tools/sim/motorway_scene.h"

#include <gtest/gtest.h>

#include "tools/sim/grey_levels_for_test.h"
#include "tools/sim/picture_world.h"
#include "tools/sim/traffic.h"

namespace relmap::sim {
namespace {

const PictureWorld& motorway() {
  static const PictureWorld world(motorway_options(1, 400));
  return world;
}

TEST(Motorway, CurvesAreWide) {
  for (std::uint64_t seed = 1; seed < 9; ++seed)
    for (const double length : {650.0, 1000.0, 2000.0, 5000.0}) {
      const sim::Circuit circuit = sim::motorway_circuit(seed, length);
      EXPECT_GT(circuit.min_radius(), 100) << length;
      EXPECT_NEAR(circuit.length(), length, 1e-6);
    }
}

TEST(Motorway, OptionsFitDrivesOfAnyLength) {
  for (const int frames : {20, 400, 2000, 6000}) EXPECT_TRUE(motorway_options(1, frames).check().ok()) << frames;
  PictureWorldOptions too_short = motorway_options(1, 400);
  too_short.laps = 2.5;
  EXPECT_EQ(too_short.check().reason(), Reason::INVALID_ARGUMENT);
}

TEST(Motorway, IsDrivenAsACarDrives) {
  for (int i = 1; i < 400; ++i) {
    const SE3 step = motorway().truth(i - 1).inverse() * motorway().truth(i);
    EXPECT_NEAR(step.t.norm(), 2.5, 0.3);
    EXPECT_LT(rotation_angle(step.R), 0.03);
  }
  for (double t = 1; t < 39; t += 0.1) EXPECT_LT(motorway().motion_at(t).acceleration.norm(), 8) << t;
}

TEST(Motorway, HasLittleTextureMostOfItFarAway) {
  for (const int frame : {10, 200, 390}) {
    const GreyPicture picture = motorway().render(frame).left;
    EXPECT_LT(sim::textured_share(picture, 0, picture.height), 0.35) << frame;
    EXPECT_GT(sim::textured_share(picture, 160, 240), 0.2) << frame;   // cars, rails, the horizon
    EXPECT_LT(sim::textured_share(picture, 250, 375), 0.25) << frame;  // the road before the car
  }
}

TEST(Motorway, TheRoadLiesUnderTheCamera) {
  const StereoCamera& camera = motorway().options().camera;
  for (const int frame : {0, 399}) {
    const std::vector<float> depth = motorway().render_depth(frame);
    const double z = depth[static_cast<std::size_t>(camera.height - 1) * camera.width + camera.width / 2];
    EXPECT_NEAR(z, camera.f * 1.65 / (camera.height - 1 - camera.cy), 0.5);
  }
}

TEST(Motorway, OtherCarsMoveAsTheirVelocitySays) {
  const sim::Circuit circuit = sim::motorway_circuit(1, 2000);
  sim::Scene scene;
  const sim::Traffic traffic(circuit, 25, scene, sim::Random(1));
  const double dt = 0.01;
  const Vector2 place = circuit.point(0);
  const auto now = traffic.near(place, 0), later = traffic.near(place, dt);
  ASSERT_GT(now.size(), 40U);
  ASSERT_EQ(now.size(), later.size());
  bool slower = false, faster = false, opposite = false;
  for (std::size_t k = 0; k < now.size(); ++k) {
    const Vector3 step = later[k].surface.corners[0] - now[k].surface.corners[0];
    EXPECT_LT((step / dt - now[k].velocity).norm(), 3);  // the circuit is a little longer in its outer lanes
    const Vector2 along = circuit.direction(0);
    const double speed = now[k].velocity.dot(Vector3(along.x(), 0, along.y()));
    slower |= speed > 0 && speed < 22;
    faster |= speed > 27;
    opposite |= speed < 0;
  }
  EXPECT_TRUE(slower && faster && opposite);
}

}  // namespace
}  // namespace relmap::sim
