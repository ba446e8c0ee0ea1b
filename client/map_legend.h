// The legend of a picture of the map, which explains its lines, dashes, marks and colours.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client/drawing.h"
#include "client/map_contents.h"

namespace relmap::client {

class MapLegend {
 public:
  // Wraps its texts so that it is no wider than `width` with the letters of `measure`, and cuts nothing off.
  MapLegend(const MapContents& contents, const Drawing& measure, double width);

  double height() const { return height_; }
  void draw(Drawing& out, const Vector2& corner) const;

 private:
  using Sample = std::function<void(Drawing& out, const Vector2& from, const Vector2& to)>;
  struct Entry {
    std::vector<std::string> text, detail;
    Sample sample;
  };
  void add(const std::string& text, const std::string& detail, Sample sample);
  void add_scale();
  void add_sessions();
  void add_motion();
  void add_closures();
  void add_tears();

  const MapContents& contents_;
  const Drawing& measure_;
  const double width_;
  std::vector<Entry> entries_;
  double height_ = 0;
};

}  // namespace relmap::client
