// Where the parts of a map lie in the plane: as they lay in the layout before, as far as they can, so that nothing
// jumps.
#pragma once

#include <optional>
#include <vector>

#include "tools/console/layout/map_layout.h"

namespace relmap::console {

// A turn and a shift of the plane.
struct PlaneMotion {
  double cosine = 1, sine = 0;
  Vector2 shift = Vector2::Zero();

  Vector2 turned(const Vector2& p) const { return {cosine * p.x() - sine * p.y(), sine * p.x() + cosine * p.y()}; }
  Vector2 operator()(const Vector2& p) const { return turned(p) + shift; }
};

// The motion that brings points nearest to where they are to be (least squares), from sums over pairs.
class PlaneFit {
 public:
  // `heading_from` and `heading_to`: a direction at the point, which decides if all points are the same.
  void add(const Vector2& from, const Vector2& to, double heading_from, double heading_to);
  std::size_t pairs() const { return pairs_; }
  PlaneMotion motion() const;

 private:
  std::size_t pairs_ = 0;
  Vector2 first_from_ = Vector2::Zero(), first_to_ = Vector2::Zero();  // sums are relative to these
  Vector2 from_ = Vector2::Zero(), to_ = Vector2::Zero();
  double dot_ = 0, cross_ = 0, turn_ = 0;
};

// The turn about the origin by which points become lowest, as a page is wider than high.
PlaneMotion lowest_turn(const std::vector<Vector2>& points);

// A part to be placed.
struct PlacedPart {
  LayoutBox box;      // its size; where it is to be if `kept`, and afterwards where it is
  bool kept = false;  // in: it was placed before, and stays if it can; out: it stayed
};
// Places the boxes, so that no two of them overlap: those that are kept in the order given, as long as they are apart;
// the others in rows below all of them. If what is kept has become sparse, only the first one is.
void place_parts(std::vector<PlacedPart>& parts);

// The square of the world: that of the layout before, if it still fits.
struct WorldSquare {
  Vector2 corner = Vector2::Zero();
  double size = 1;
};
WorldSquare world_around(const LayoutBox& all, const std::optional<WorldSquare>& before);

}  // namespace relmap::console
