// The town of `relmap-bench vast`: streets, robots that drive them, and what their features look like.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/place/vocabulary.h"
#include "tools/sim/city_world.h"

namespace relmap::bench {

struct VastOptions {
  std::uint64_t keyframes = 300'000;  // of all robots together
  std::uint32_t robots = 8;
  std::uint64_t seed = 1;
  bool light = false;  // keyframes of a fifth of the size
  std::size_t memory_budget_mb = 512;
  std::uint32_t kills = 10;
  std::string folder;   // kept, and continued if it holds an unfinished run; empty: a temporary one
  std::string picture;  // of the map
  std::string page;     // HTML, with the picture in it
  std::string edges;    // a table of the edges and closures in force with their errors, TSV
};

// Draws descriptors with the vocabulary's statistics: three of four features of a stretch of street show a word of one
// of the vocabulary's sample places, the others any word as often as it is seen. From its word's centroid a descriptor
// is as far as those of a rendered drive (254 of 512, the median). Thread-safe.
sim::DrawDescriptor draw_words(std::shared_ptr<const place::Vocabulary> vocabulary);

class VastTown {
 public:
  explicit VastTown(const VastOptions& options);

  const sim::CityWorld& world() const { return *world_; }
  std::uint32_t robots() const { return static_cast<std::uint32_t>(drives_.size()); }
  std::uint32_t frames(std::uint32_t robot) const { return drives_[robot].frames; }
  SessionHeader header(std::uint32_t robot) const;
  // Makes the robot's keyframes from number `first` on. The town must outlive it.
  sim::CityRobot robot(std::uint32_t robot, std::uint32_t first = 0) const;
  // The robot whose session has this name; robots() if none has.
  std::uint32_t robot_of(const std::string& session) const;

 private:
  std::unique_ptr<const sim::CityWorld> world_;
  std::vector<sim::CityDriveOptions> drives_;
};

}  // namespace relmap::bench
