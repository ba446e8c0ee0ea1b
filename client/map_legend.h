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
  // Wraps its texts so that a column is no wider than `width` with the letters of `measure`, and cuts nothing off.
  MapLegend(const MapContents& contents, const Drawing& measure, double width);

  // Of the legend in at most so many columns, filled one after the other.
  double height(std::size_t columns) const;
  // `corner`: the top left one of the first column. `apart`: of columns' left edges from each other.
  void draw(Drawing& out, const Vector2& corner, std::size_t columns, double apart) const;

 private:
  using Sample = std::function<void(Drawing& out, const Vector2& from, const Vector2& to)>;
  struct Entry {
    std::vector<std::string> text, detail;
    Sample sample;
    double height = 0;     // with the gap below it
    bool heading = false;  // of the entry below it, which is in the same column
  };
  // The entries that begin the second and further columns, if no column is higher than `height`.
  std::vector<std::size_t> breaks(double height) const;
  Entry& add(const std::string& text, const std::string& detail, Sample sample);
  void add_scale();
  void add_sessions();
  void add_names();
  void add_motion();
  void add_closures();
  void add_tears();

  const MapContents& contents_;
  const Drawing& measure_;
  const double width_;
  std::vector<Entry> entries_;
};

}  // namespace relmap::client
