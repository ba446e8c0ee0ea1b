// Plots of benchmark results: curves over one axis.
#pragma once

#include <string>
#include <vector>

namespace relmap::bench {

struct Curve {
  std::string name;
  std::vector<double> x, y;  // of the same length; only finite values are drawn
  bool dots = false;         // false: a line
};

struct Plot {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;  // values must be positive
  std::vector<Curve> curves;
};

// A curve with one value for each step, from 0.
Curve curve_by_step(std::string name, std::vector<double> y);

// Writes PNG if the path ends in .png, else SVG; nothing if the path is empty. Throws StatusError (IO_ERROR).
void save_plot(const Plot& plot, const std::string& path);

}  // namespace relmap::bench
