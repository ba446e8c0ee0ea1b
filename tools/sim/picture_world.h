// A textured world made from a seed, and a stereo camera driven round it: pictures with exact truth.
//
// The world is a closed street with houses on both sides, pavements, posters, trees. The camera goes round it, a little
// beside its own track on each lap, turned by a few degrees. World coordinates: y down, the ground at y = 0, x and z in
// the plane; metres. Everything is a function of the options.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "proto/camera.h"
#include "proto/geometry.h"
#include "proto/status.h"

namespace relmap {

struct PictureWorldOptions {
  std::uint64_t seed = 1;
  int frames = 650;
  double laps = 1.3;  // how often the frames go round: the circuit is frames * step / laps long
  double step = 0.2;  // metres between two frames, on average
  double rate = 10;   // frames per second
  std::int64_t start_us = 1'600'000'000'000'000;  // UTC time of the first frame
  StereoCamera camera{.f = 400, .cx = 255.5, .cy = 191.5, .baseline = 0.12, .width = 512, .height = 384};
  double camera_height = 1.0;        // metres above the ground
  double lateral_deviation = 0.25;   // metres, at most, beside the middle of the road
  double heading_deviation = 0.04;   // radians, at most
  double noise = 2.0;                // standard deviation of a pixel's value (0..255)
  double exposure_variation = 0.06;  // relative, at most, slowly over the drive

  double circuit_length() const { return frames * step / laps; }
  // INVALID_ARGUMENT, or IMPLAUSIBLE_CALIBRATION of the camera. The circuit must be 20 .. 400 m long.
  Status check() const;
};

// Grey, row by row.
struct GreyPicture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
};

struct StereoPictures {
  GreyPicture left, right;
};

// Immutable: every function may be called from any thread.
class PictureWorld {
 public:
  explicit PictureWorld(const PictureWorldOptions& options);  // options.check() must be OK; takes about a second
  ~PictureWorld();
  PictureWorld(PictureWorld&&) noexcept;
  PictureWorld& operator=(PictureWorld&&) noexcept;

  const PictureWorldOptions& options() const;
  // Of frame i, 0 .. frames - 1. T_world_left: the left camera in the world.
  SE3 truth(int i) const;
  std::int64_t time_us(int i) const;
  StereoPictures render(int i) const;
  // Depth (z) at each left pixel's centre, metres; row by row.
  std::vector<float> render_depth(int i) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace relmap
